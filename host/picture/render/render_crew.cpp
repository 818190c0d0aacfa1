// Several devices, or one whose volume comes by bricks: bands of rows go to whoever is free. Calls
// enqueue_frame() of raycast.cpp and paged_frame.cpp.
#include "vdvr/expert/render_crew.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <span>
#include <thread>
#include <tuple>

#include "host/picture/render/check_render_options.hpp"
#include "host/picture/render/raycast.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {

struct RenderCrew::Impl {
  struct Part {
    Device* device;
    const ResidentVolume* volume;
    const PagedVolume* paged;
    Frame frame;
  };
  std::vector<Part> members;
};

RenderCrew::RenderCrew(const std::vector<Member>& members) : impl_(new Impl) {
  if (members.empty()) throw InputError("a crew of renderers without a device");
  for (const Member& m : members) {
    if (!m.device || (m.volume == nullptr) == (m.paged == nullptr))
      throw InputError("each device of a crew of renderers has one volume, whole or by bricks");
    Frame frame(m.volume ? drawn_field(*m.volume) : drawn_field(*m.paged));
    impl_->members.push_back({m.device, m.volume, m.paged, std::move(frame)});
  }
}
RenderCrew::~RenderCrew() = default;
RenderCrew::RenderCrew(RenderCrew&&) noexcept = default;
RenderCrew& RenderCrew::operator=(RenderCrew&&) noexcept = default;

void RenderCrew::set_bounds(const std::vector<float>& bounds) {
  for (auto& m : impl_->members) m.frame.set_bounds(bounds);
}

namespace {

// Rows that one device takes at a time: some for each, so that they end together.
std::int64_t rows_together(std::int64_t height, std::size_t devices) {
  constexpr std::int64_t step = 16, turns = 4;
  const std::int64_t share = height / (turns * static_cast<std::int64_t>(devices));
  return std::max(step, (share + step - 1) / step * step);
}

}  // namespace

RenderResult RenderCrew::render(const RenderOptions& asked, const Progress& progress) {
  check_options(asked);
  auto& members = impl_->members;
  const auto start = std::chrono::steady_clock::now();
  // `automatic` is settled once: devices that measure or hold something else would draw another picture.
  RenderOptions o = asked;
  RenderResult r;
  const auto& first = members.front();
  std::tie(o.sampler, r.sampler_reason) = first.volume
                                              ? choose_sampler(*first.device, *first.volume, asked.sampler)
                                              : choose_sampler(asked.sampler);
  o.gradient = choose_gradient(o, o.sampler, std::all_of(members.begin(), members.end(), [](const auto& m) {
                                 return m.volume ? m.volume->impl().lit_fits() : stored_would_fit(*m.paged);
                               }));
  r.sampler = o.sampler;
  r.gradient = o.gradient;
  std::vector<cl_float4> pixels(static_cast<std::size_t>(o.width * o.height));
  const std::int64_t step = rows_together(o.height, members.size());
  std::atomic<std::int64_t> next{0}, samples{0};
  std::atomic<bool> stop{false};
  std::exception_ptr failure;
  std::mutex failure_lock, progress_lock;
  std::int64_t drawn = 0;
  const Drawn report_drawn = [&](const PixelBox& part) {
    const std::lock_guard guard(progress_lock);
    drawn += (part.x1 - part.x0) * (part.y1 - part.y0);
    report(progress, "draw", static_cast<double>(drawn) / static_cast<double>(o.width * o.height));
  };
  const auto work = [&](Impl::Part& m) {
    try {
      for (std::int64_t y = next.fetch_add(step); y < o.height && !stop; y = next.fetch_add(step)) {
        const Rows rows{y, std::min(y + step, o.height)};
        if (m.volume) enqueue_frame(m.frame, *m.device, *m.volume, o, {}, rows);
        else enqueue_frame(m.frame, *m.device, *m.paged, o, {}, rows, report_drawn);
        m.frame.picture().read(std::span(pixels).subspan(static_cast<std::size_t>(y * o.width),
                                                         static_cast<std::size_t>((rows.end - y) * o.width)),
                               static_cast<std::uint64_t>(y * o.width));
        samples += m.frame.samples();
        throw_if_stopped();
        if (m.volume) report_drawn({0, rows.first, o.width, rows.end});
      }
    } catch (...) {
      const std::lock_guard guard(failure_lock);
      if (!failure) failure = std::current_exception();
      stop = true;
    }
  };
  {
    std::vector<std::jthread> others;
    for (std::size_t i = 1; i < members.size(); ++i)
      others.emplace_back([&work, &members, i] { work(members[i]); });
    work(members.front());
  }
  if (failure) std::rethrow_exception(failure);
  r.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  r.samples = samples;
  convert(pixels, o, r);
  return r;
}

}  // namespace vdvr
