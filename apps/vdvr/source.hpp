// What `render` and `bench render` draw: a volume on the device or, with --method d2vr, projections.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/expert/d2vr.hpp"
#include "vdvr/expert/drawn_volume.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/paged_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/render_crew.hpp"
#include "vdvr/expert/safe_sampler.hpp"

namespace vdvr::cli {

/// Null for a volume that is on the device as a whole.
Json paging_json(const std::optional<PagingCounts>& counts);
/// A line, or none.
void print_paging(const std::optional<PagingCounts>& counts);

void add_method(Arguments& args);
/// A group of the options that only d2vr has, without the scan's (add_scan).
void add_projection_options(Arguments& args);
/// Throws InputError for options that the method does not take.
std::string method_option(const Arguments& args);

class Source {
 public:
  /// Reads FILE, then opens the device. Throws as open_scene, load_scan, ResidentVolume and D2vrScene.
  Source(const Arguments& args, const CommonOptions& common, const std::string& method, bool unverified,
         const Progress& progress);
  Source(const Source&) = delete;  // the scene refers to the field
  Source& operator=(const Source&) = delete;

  /// Of projections the field on the grid's samples, without a certificate.
  [[nodiscard]] const Scene& scene() const { return *scene_; }
  [[nodiscard]] Device& device() { return *devices_.front(); }
  /// Of all devices that draw: they passed their test when they were opened.
  [[nodiscard]] bool trusted();
  /// As of vdvr/expert/trust.hpp, of each of them.
  void require_trusted(const std::string& what);
  /// What safe_sampler() says of the device that draws. Bounds are afterwards those of its certificate.
  SafeSampler take_sampler(SamplerKind asked, bool unverified);
  /// As take_sampler() found it, else as the file has it; throws InputError where there is none.
  [[nodiscard]] const Certificate& certificate() const;
  /// What RenderOutput::error shows of a brick; before the first picture.
  void show(BrickQuantity quantity) { shown_.quantity = quantity; }
  /// As the latest such picture has it.
  [[nodiscard]] const BrickValues& shown() const { return shown_; }
  /// `progress` hears of pictures by several devices, or by bricks.
  [[nodiscard]] RenderResult draw(const RenderOptions& options, const Progress& progress = {});
  /// What certified pictures are drawn of; not of projections.
  [[nodiscard]] DrawnVolume& volume() { return *drawn_; }
  /// Of a volume's samples.
  [[nodiscard]] std::pair<float, float> value_range() const;
  /// On the device beside what a frame needs: volume, or projections; of a volume by bricks the most
  /// so far.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Of a volume that is brought to the device by bricks.
  [[nodiscard]] std::optional<PagingCounts> paging() const;

 private:
  void open_projections(const Arguments& args, const CommonOptions& common, const Progress& progress);

  std::optional<Scene> scene_;
  std::vector<std::unique_ptr<Device>> devices_;  ///< all that draw
  std::optional<DrawnVolume> drawn_;              ///< or, of projections:
  std::optional<D2vrField> field_;
  std::optional<D2vrScene> projections_;
  std::optional<Renderer> renderer_;
  std::optional<Certificate> here_;  ///< on the devices that draw
  BrickValues shown_;                // empty until a picture asks
};

}  // namespace vdvr::cli
