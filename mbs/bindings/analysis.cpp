#include "bindings/analysis/analysis.h"

#include "bindings/bindings.h"

void bind_analysis(nanobind::module_ &m) {
  bind_run(m);
  bind_sensing(m);
}
