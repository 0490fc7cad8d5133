// Columns (d) and square matrices (d, d) of numbers that may be complex, in plain loops: with Eigen's products of them
// newton_tree.cpp took ten times as long to compile, and was twice as large.
#pragma once

#include <Eigen/Core>

#include <complex>
#include <utility>

namespace ffrobot {

template <class A, class B> using ProductOf = decltype(A() * B());

// By which pivots are chosen
inline double size_of(double x) { return std::abs(x); }
inline double size_of(const std::complex<double> &x) { return std::abs(x.real()) + std::abs(x.imag()); }

template <class T, int d> struct Column {
  T x[d] = {};

  T &operator[](int i) { return x[i]; }
  const T &operator[](int i) const { return x[i]; }
  Column &operator+=(const Column &o) {
    for (int i = 0; i < d; ++i)
      x[i] += o.x[i];
    return *this;
  }
  Column &operator-=(const Column &o) {
    for (int i = 0; i < d; ++i)
      x[i] -= o.x[i];
    return *this;
  }
  template <class S, class O> void add(const S &factor, const Column<O, d> &o) {
    for (int i = 0; i < d; ++i)
      x[i] += factor * o.x[i];
  }
  Column operator-() const {
    Column negative;
    for (int i = 0; i < d; ++i)
      negative.x[i] = -x[i];
    return negative;
  }
  friend Column operator+(Column a, const Column &b) { return a += b; }
  friend Column operator-(Column a, const Column &b) { return a -= b; }
};

template <class A, class B, int d> ProductOf<A, B> dot(const Column<A, d> &a, const Column<B, d> &b) {
  ProductOf<A, B> sum = a[0] * b[0];
  for (int i = 1; i < d; ++i)
    sum += a[i] * b[i];
  return sum;
}

template <class T, int d> struct Square {
  Column<T, d> column[d];

  static Square identity() {
    Square one;
    for (int i = 0; i < d; ++i)
      one(i, i) = T(1);
    return one;
  }
  // The first columns of one that Eigen keeps
  template <class Matrix> static Square of(const Matrix &M) {
    Square copy;
    for (int c = 0; c < static_cast<int>(M.cols()); ++c)
      for (int r = 0; r < d; ++r)
        copy(r, c) = M(r, c);
    return copy;
  }

  T &operator()(int r, int c) { return column[c][r]; }
  const T &operator()(int r, int c) const { return column[c][r]; }
  Square &operator+=(const Square &o) {
    for (int c = 0; c < d; ++c)
      column[c] += o.column[c];
    return *this;
  }
  Square &operator-=(const Square &o) {
    for (int c = 0; c < d; ++c)
      column[c] -= o.column[c];
    return *this;
  }
  friend Square operator+(Square a, const Square &b) { return a += b; }
  Square transpose() const {
    Square turned;
    for (int c = 0; c < d; ++c)
      for (int r = 0; r < d; ++r)
        turned(r, c) = (*this)(c, r);
    return turned;
  }
};

template <class A, class B, int d> Column<ProductOf<A, B>, d> operator*(const Square<A, d> &M, const Column<B, d> &x) {
  Column<ProductOf<A, B>, d> y;
  for (int c = 0; c < d; ++c)
    for (int r = 0; r < d; ++r)
      y[r] += M(r, c) * x[c];
  return y;
}

template <class A, class B, int d>
[[gnu::noinline]] Square<ProductOf<A, B>, d> operator*(const Square<A, d> &a, const Square<B, d> &b) {
  Square<ProductOf<A, B>, d> product;
  for (int c = 0; c < d; ++c)
    product.column[c] = a * b.column[c];
  return product;
}

// M^T x
template <class A, class B, int d>
Column<ProductOf<A, B>, d> transposed_product(const Square<A, d> &M, const Column<B, d> &x) {
  Column<ProductOf<A, B>, d> y;
  for (int c = 0; c < d; ++c)
    y[c] = dot(M.column[c], x);
  return y;
}

// Of the first n rows and columns, by Gauss and Jordan with the largest pivot of a column
template <class T, int d> [[gnu::noinline]] Square<T, d> inverse(Square<T, d> M, int n = d) {
  int from[d];
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int r = k + 1; r < n; ++r)
      if (size_of(M(r, k)) > size_of(M(best, k)))
        best = r;
    from[k] = best;
    if (best != k)
      for (int c = 0; c < n; ++c)
        std::swap(M(k, c), M(best, c));
    const T pivot = T(1) / M(k, k);
    M(k, k) = T(1);
    for (int c = 0; c < n; ++c)
      M(k, c) *= pivot;
    Column<T, d> factor = M.column[k];
    factor[k] = T(0);
    for (int r = 0; r < n; ++r)
      if (r != k)
        M(r, k) = T(0);
    for (int c = 0; c < n; ++c) {
      const T of_row = M(k, c);
      for (int r = 0; r < n; ++r)
        M(r, c) -= factor[r] * of_row;
    }
  }
  for (int k = n; k-- > 0;)
    if (from[k] != k)
      std::swap(M.column[k], M.column[from[k]]);
  return M;
}

} // namespace ffrobot
