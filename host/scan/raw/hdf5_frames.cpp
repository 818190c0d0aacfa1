// See hdf5_frames.hpp.
#include "host/scan/raw/hdf5_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "host/base/system/limits.hpp"
#include "host/base/system/lower.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {

using hdf5::Dataset, hdf5::Reader;

namespace {

// The axis of the angles by the names in `axes`, "theta:y:x" or one string per axis; -1 when they do not say.
int angle_axis(const Reader& file, const std::string& object) {
  std::vector<std::string> names = file.find_texts(object, "axes");
  if (names.size() == 1) {
    std::string text = names[0];
    std::replace_if(
        text.begin(), text.end(), [](char c) { return std::string(",[] ").find(c) != std::string::npos; },
        ':');
    names.clear();
    for (std::size_t start = 0; start < text.size();) {
      const std::size_t end = std::min(text.find(':', start), text.size());
      if (end > start) names.push_back(text.substr(start, end - start));
      start = end + 1;
    }
  }
  for (std::size_t a = 0; a < names.size(); ++a)
    for (const char* word : {"theta", "angle", "rotation"})
      if (names[a].find(word) != std::string::npos) return static_cast<int>(a);
  return -1;
}

// Frames first .. first + n - 1 of a stack as out[n][row][column].
void read_run(const FrameStack& stack, std::int64_t first, std::int64_t n, double* out) {
  const std::int64_t rows = stack.rows, columns = stack.columns;
  if (stack.data->shape.size() == 2)
    return stack.data->read(std::array<std::int64_t, 2>{0, 0}, std::array<std::int64_t, 2>{rows, columns},
                            out);
  if (stack.axis == 0)
    return stack.data->read(std::array<std::int64_t, 3>{first, 0, 0},
                            std::array<std::int64_t, 3>{n, rows, columns}, out);
  std::vector<double> sinograms(static_cast<std::size_t>(n * rows * columns));
  stack.data->read(std::array<std::int64_t, 3>{0, first, 0}, std::array<std::int64_t, 3>{rows, n, columns},
                   sinograms.data());
  for (std::int64_t k = 0; k < n; ++k)
    for (std::int64_t v = 0; v < rows; ++v)
      std::copy_n(sinograms.data() + (v * n + k) * columns, columns, out + (k * rows + v) * columns);
}

// As whoever wrote it spells it: Degrees, DEG, Radians.
AngleUnit unit_of_angles(const Reader& file, const std::string& object, const std::string& name) {
  const std::string written = file.find_text(object, "units").value_or("degrees");
  const std::string unit = lower(written);
  if (unit.rfind("rad", 0) == 0) return AngleUnit::radians;
  if (unit.rfind("deg", 0) == 0 || unit == "\u00b0" || unit.empty()) return AngleUnit::degrees;
  throw FileError(fmt::format("{}: units '{}'; degrees or radians are needed (`angle_unit` states which)",
                              name, written));
}

}  // namespace

FrameStack open_frames(const Reader& file, const std::string& object, int fallback_axis) {
  FrameStack stack;
  stack.data = std::make_shared<const Dataset>(file.numeric_dataset(object));
  const auto shape = stack.data->extents();
  checked_bytes(shape, sizeof(double), stack.data->name);
  if (shape.size() == 2) {
    stack.count = 1;
    stack.rows = shape[0];
    stack.columns = shape[1];
    return stack;
  }
  if (shape.size() != 3)
    throw FileError(fmt::format("{}: shape {}; three axes are needed, [angle][v][u]", stack.data->name,
                                shape_text(shape)));
  const int stated = angle_axis(file, object);
  stack.axis = stated >= 0 ? stated : fallback_axis;
  if (stack.axis > 1)
    throw FileError(
        fmt::format("{}: 'axes' puts the angle on axis {}; it must be the first (projections) or the second "
                    "(sinograms)",
                    stack.data->name, stack.axis));
  const auto axis = static_cast<std::size_t>(stack.axis);
  stack.count = shape[axis];
  stack.rows = shape[1 - axis];
  stack.columns = shape[2];
  return stack;
}

Frames frames_of(const FrameStack& stack, std::vector<std::int64_t> numbers, const std::string& what) {
  Frames frames;
  frames.count = static_cast<std::int64_t>(numbers.size());
  const auto list = std::make_shared<const std::vector<std::int64_t>>(std::move(numbers));
  frames.name = [stack, list, what](std::int64_t k) {
    return fmt::format("{}: {} {} (frame {})", stack.data->name, what, k,
                       (*list)[static_cast<std::size_t>(k)]);
  };
  frames.read = [stack, list](std::int64_t first, std::int64_t n, double* out) {
    const std::int64_t size = stack.rows * stack.columns;
    for (std::int64_t k = 0; k < n;) {
      const std::int64_t start = (*list)[static_cast<std::size_t>(first + k)];
      std::int64_t run = 1;
      while (k + run < n && (*list)[static_cast<std::size_t>(first + k + run)] == start + run) ++run;
      read_run(stack, start, run, out + k * size);
      k += run;
    }
  };
  return frames;
}

Frames all_frames(const FrameStack& stack, const std::string& what) {
  Frames frames;
  frames.count = stack.count;
  frames.name = [stack, what](std::int64_t k) { return fmt::format("{}: {} {}", stack.data->name, what, k); };
  frames.read = [stack](std::int64_t first, std::int64_t n, double* out) { read_run(stack, first, n, out); };
  return frames;
}

std::int64_t count_of(const Dataset& data) {
  return static_cast<std::int64_t>(checked_bytes(data.extents(), 1, data.name));
}

std::vector<double> read_angles(const Reader& file, const std::string& object,
                                const std::vector<std::int64_t>& counts, const FrameStack& frames,
                                std::optional<AngleUnit> stated) {
  const char* remedy =
      "; state them by `angles_file`, or in scan.json by 'angles' beside 'hdf5', one for each projection";
  if (!file.is_dataset(object)) file.refuse(object, std::string("no such dataset, the angles") + remedy);
  const Dataset data = file.numeric_dataset(object);
  if (std::find(counts.begin(), counts.end(), count_of(data)) == counts.end())
    throw FileError(
        fmt::format("{}: {} angles for {} frames of {}; one per frame is needed (data in sinogram "
                    "order must say so with an attribute axes = \"y:theta:x\"){}",
                    data.name, count_of(data), frames.count, frames.data->name, remedy));
  const AngleUnit unit = stated ? *stated : unit_of_angles(file, object, data.name);
  return in_degrees(data.read_all(), unit);
}

std::vector<double> read_currents(const Reader& file, const std::string& wanted, const std::string& usual,
                                  std::int64_t frames, const char* order, std::string& name) {
  if (wanted == "none") return {};
  const std::string object = wanted.empty() ? usual : wanted;
  if (wanted.empty() && !file.is_dataset(object)) return {};
  if (!file.is_dataset(object)) file.refuse(object, "no such dataset, the beam's current (`beam_current`)");
  const Dataset data = file.numeric_dataset(object);
  if (wanted.empty() && count_of(data) == 1) return {};
  if (count_of(data) != frames)
    throw FileError(
        fmt::format("{}: {} currents of the beam for {} frames; one for each is needed, {}; `beam_current` "
                    "none leaves them out",
                    data.name, count_of(data), frames, order));
  name = object;
  return data.read_all();
}

void require_same_detector(const FrameStack& a, const FrameStack& b) {
  if (a.rows != b.rows || a.columns != b.columns)
    throw FileError(fmt::format("{}: frames of {} rows x {} columns, but {} has {} x {}", b.data->name,
                                b.rows, b.columns, a.data->name, a.rows, a.columns));
}

}  // namespace vdvr::io
