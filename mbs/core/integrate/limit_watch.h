// Whether coordinates leave their ranges while a run is integrated: when they first do, and how far they go, between
// outputs and between ends of steps. Nothing of the run depends on it: it looks at steps that are accepted, and where a
// method needs more slopes for its dense output, they are those of another system.
#pragma once

#include "core/integrate/method.h"

#include <optional>

namespace ffrobot {

// A number among the coordinates, and the range that it is meant to stay in. Infinite where one side has no limit.
struct LimitedCoordinate {
  Index v = 0; // its place in v
  double lowest, highest;
};

// What was seen of one from the start of the run.
struct RangeSeen {
  double least, largest;
  std::optional<double> left_at; // s: when it was first outside

  FFROBOT_FIELDS(least, largest, left_at);
};

class LimitWatch {
public:
  // `system` is integrated; `other`, the same once more, makes steps again. Both must outlive this.
  LimitWatch(std::vector<LimitedCoordinate> limited, const OdeSystem &system, OdeSystem &other);

  void begin(double t, const double *z);
  void go_on(const std::vector<RangeSeen> &seen) { seen_ = seen; } // of a run that has begun before, with these limits

  // The step of length h from (t, z) that `method` has made and finished, before that accepts it.
  void look(Method &method, const MethodChoice &choice, double t, const double *z, double h);

  const std::vector<RangeSeen> &seen() const { return seen_; } // of each

private:
  struct Step {
    Method *method;
    const MethodChoice *choice;
    double t;
    const double *z;
    double h;
  };

  void look_at(const LimitedCoordinate &limited, RangeSeen &seen);
  void prepare_dense();                                                     // once a step, where it is needed
  const double *between(double x);                                          // the state at this part of the step
  double leave(const LimitedCoordinate &limited, double begin, double end); // where it is first outside

  std::vector<LimitedCoordinate> limited_;
  std::vector<RangeSeen> seen_;
  const OdeSystem &system_;
  OdeSystem &other_;
  Step step_{};
  Method *dense_ = nullptr;       // of this step, once prepared
  std::unique_ptr<Method> again_; // on the other system
  MethodKind kind_of_again_{};
  VectorXd z_;
};

} // namespace ffrobot
