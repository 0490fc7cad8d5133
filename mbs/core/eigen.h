// Names of Eigen that all of the core uses.
#pragma once

#include <Eigen/Core>

namespace ffrobot {

using Eigen::ArrayXd, Eigen::Dynamic, Eigen::Index, Eigen::Map, Eigen::Matrix, Eigen::Matrix2d, Eigen::Matrix3d;
using Eigen::MatrixXd, Eigen::Ref, Eigen::RowVectorXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXcd;
using Eigen::VectorXd;
using RowMajor = Matrix<double, Dynamic, Dynamic, Eigen::RowMajor>;
using Rows = Ref<const RowMajor>; // of others, without a copy

} // namespace ffrobot
