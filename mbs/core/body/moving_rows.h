// Rows of W that move with p: m_thetaf of bodies with S_tilde, and second-order displacements (geometric stiffening).
#pragma once

#include "core/body/planar_body.h"

namespace ffrobot {

// Rows of W, second-order parts of displacements and their rates at (p, p_dot), for kinematics.
void update_moving_rows(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &state);

// L D L^T of the translational block m I - S_bar S_bar^T of the frame's mass matrix, p eliminated.
void factorise_translation(double mass, PlanarBodyState &state);

} // namespace ffrobot
