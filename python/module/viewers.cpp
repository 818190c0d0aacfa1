// A viewer's state and its frames, for notebooks.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <string>
#include <utility>

#include "arrays.hpp"
#include "held_volume.hpp"
#include "long_work.hpp"
#include "parts.hpp"
#include "vdvr/expert/live_events.hpp"
#include "vdvr/expert/live_json.hpp"
#include "vdvr/expert/live_renderer.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace vdvr::python {
namespace {

/// One view of one volume, and what draws it. Of one thread, as its owner is.
class LiveVolume {
 public:
  LiveVolume(std::shared_ptr<HeldVolume> held, std::shared_ptr<Device> device, std::int64_t width,
             std::int64_t height)
      : held_(std::move(held)),
        device_(std::move(device)),
        certificate_(held_->certificate()),
        renderer_(*device_, held_->file().volume, certificate_),
        state_(first_state(renderer_.scene(), width, height)) {}

  /// {"state", "events"}, as live_request reads it.
  void request(const std::string& text) { state_ = live_request(text, renderer_.scene(), state_); }
  [[nodiscard]] std::string state() const { return to_json(state_); }
  [[nodiscard]] std::string scene() const { return to_json(renderer_.scene()); }
  [[nodiscard]] std::vector<std::string> words() const {
    return render_words(state_.view, renderer_.scene(), state_.width, state_.height);
  }
  LiveFrame draw(bool moving) { return renderer_.draw(state_.view, state_.width, state_.height, moving); }

 private:
  std::shared_ptr<HeldVolume> held_;
  std::shared_ptr<Device> device_;
  std::optional<Certificate> certificate_;
  LiveRenderer renderer_;
  LiveState state_;
};

}  // namespace

void add_viewers(nb::module_& m) {
  nb::class_<LiveVolume>(m, "LiveVolume")
      .def(nb::init<std::shared_ptr<HeldVolume>, std::shared_ptr<Device>, std::int64_t, std::int64_t>(),
           "volume"_a, "device"_a, "width"_a, "height"_a)
      .def("request", &LiveVolume::request, "text"_a)
      .def_prop_ro("state", &LiveVolume::state)
      .def_prop_ro("scene", &LiveVolume::scene)
      .def_prop_ro("words", &LiveVolume::words)
      .def(
          "draw",
          [](LiveVolume& live, bool moving) {
            LiveFrame frame;
            run_long(nb::none(), [&](const Progress&) { frame = live.draw(moving); });
            const auto height = static_cast<std::size_t>(frame.image.height),
                       width = static_cast<std::size_t>(frame.image.width);
            return nb::make_tuple(as_array(std::move(frame.image.rgb), {height, width, 3}), frame.full);
          },
          "moving"_a);
}

}  // namespace vdvr::python
