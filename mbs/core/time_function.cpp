#include "core/time_function.h"
