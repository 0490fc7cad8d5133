// Plain data to bytes and back, both ways by one description of each record: its fields (fields.h).
// Bytes are those of this machine's numbers; a file is read by the program that it was written with.
#pragma once

#include "core/eigen.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace ffrobot {

class Writer {
public:
  static constexpr bool reads = false;

  void raw(const void *data, std::size_t size) { bytes.append(static_cast<const char *>(data), size); }

  std::string bytes;
};

class Reader {
public:
  static constexpr bool reads = true;

  explicit Reader(const std::string &bytes) : bytes_(bytes) {}

  // Throws std::runtime_error where the bytes end before.
  void raw(void *data, std::size_t size) {
    if (size > left())
      throw std::runtime_error("expected more data, found the end of the file");
    std::copy_n(bytes_.data() + at_, size, static_cast<char *>(data)); // data is null for matrices without entries
    at_ += size;
  }
  std::size_t left() const { return bytes_.size() - at_; }

private:
  const std::string &bytes_;
  std::size_t at_ = 0;
};

template <class Archive> std::int64_t archived_count(Archive &archive, std::int64_t count) {
  archive.raw(&count, sizeof count);
  if constexpr (Archive::reads)
    if (count < 0 || static_cast<std::uint64_t>(count) > archive.left())
      throw std::runtime_error("expected a count, found " + std::to_string(count));
  return count;
}

template <class Archive, class T> void archived(Archive &archive, T &x);

template <class Archive, class T, std::size_t N> void archived_range(Archive &archive, std::array<T, N> &x) {
  for (T &each : x)
    archived(archive, each);
}
template <class Archive, class Range> void archived_range(Archive &archive, Range &x) {
  const std::int64_t count = archived_count(archive, static_cast<std::int64_t>(x.size()));
  if constexpr (Archive::reads)
    x.resize(count);
  for (auto &each : x)
    archived(archive, each);
}

template <class Archive, class Matrix> void archived_matrix(Archive &archive, Matrix &x) {
  const std::int64_t rows = archived_count(archive, x.rows()), columns = archived_count(archive, x.cols());
  if constexpr (Archive::reads) {
    if (rows * columns > static_cast<std::int64_t>(archive.left() / sizeof(double)))
      throw std::runtime_error("expected a matrix, found the end of the file");
    x.resize(rows, columns);
  }
  archive.raw(x.data(), x.size() * sizeof(double));
}

template <class Archive, class T> void archived_parts(Archive &archive, std::optional<T> &x) {
  bool is_there = x.has_value();
  T value = x.value_or(T());
  archived(archive, is_there), archived(archive, value);
  x = is_there ? std::optional(value) : std::nullopt;
}
template <class Archive, class A, class B> void archived_parts(Archive &archive, std::pair<A, B> &x) {
  archived(archive, x.first), archived(archive, x.second);
}
template <class Archive, class T> void archived_parts(Archive &archive, T &x) {
  x.fields([&](const char *, auto &...member) { (archived(archive, member), ...); });
}

template <class Archive, class T> void archived(Archive &archive, T &x) {
  if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
    archive.raw(&x, sizeof x);
  else if constexpr (std::is_base_of_v<Eigen::EigenBase<T>, T>)
    archived_matrix(archive, x);
  else if constexpr (requires { x.begin(); })
    archived_range(archive, x);
  else
    archived_parts(archive, x);
}

template <class T> std::string to_bytes(T x) { // a copy: one description serves both ways
  Writer writer;
  archived(writer, x);
  return writer.bytes;
}

// Throws std::runtime_error for bytes that are none of to_bytes().
template <class T> T of_bytes(const std::string &bytes) {
  Reader reader(bytes);
  T x{};
  archived(reader, x);
  if (reader.left() != 0)
    throw std::runtime_error("expected the end of the file, found more data");
  return x;
}

} // namespace ffrobot
