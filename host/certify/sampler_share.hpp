// What a build leaves of epsilon for the samplers of its devices (docs/error-bounds.md, section 8). What they
// take is known only of a volume that is stored; the texture unit's part can be many times the buffer's. It
// is each brick's own, and falls as bricks with steep samples are refined.
#pragma once

#include <optional>
#include <vector>

#include "host/certify/crew/crew.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/gold/node_tolerance.hpp"
#include "host/scan/units.hpp"
#include "host/volume/sampler/sampler_terms.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/plan.hpp"

namespace vdvr {

/// No refinement that was tried leaves room for the texture unit.
struct NoRoomForImage3d : ToleranceError {
  using ToleranceError::ToleranceError;
};

class SamplerShare {
 public:
  /// `epsilon_abs` in `units`, as all values here; `arithmetic`: what rounding up to gold takes. Where
  /// nothing is charged (terms grid) all of epsilon is left. Refers to the plan and the devices. `base`:
  /// slopes of the base volume, by which a reserve is left for the buffer at first, and nothing beside it for
  /// a coarse texture unit. For a fine one what the longest atlas would take is left, unless bricks have
  /// `bounds` of their own. Throws ToleranceError where nothing is left for nodes.
  SamplerShare(const std::vector<Crew::Kind>& kinds, const Plan& plan, const Units& units, double epsilon_abs,
               double arithmetic, const FieldSlopes& base, std::vector<double> bounds = {});

  /// On the worst of the devices.
  [[nodiscard]] SamplerTerms of(const MixedVolume& volume) const;
  /// What a bound holds beside what is measured at nodes: arithmetic, and what the worse sampler takes; the
  /// buffer, where bricks have bounds of their own and a coarse texture unit takes its part of each.
  [[nodiscard]] double beside_nodes(const SamplerTerms& sampler) const;
  /// What nodes of all bricks are brought within now.
  [[nodiscard]] double now() const { return now_; }

  /// What |V - gold| + T + P may be at first, within this tolerance. Throws ToleranceError where nothing is
  /// left.
  [[nodiscard]] double first_tolerance(double epsilon_abs) const;

  /// A volume is begun: what it is to be brought within at first.
  NodeTolerance begin();
  /// What to bring a measured volume within, so that the certificate holds for its samplers; nothing where it
  /// does, where it is to be begun anew(), or where nothing smaller is to be tried. `bricks`: as measured.
  /// Throws NoRoomForImage3d, and ToleranceError where the buffer has no room.
  std::optional<NodeTolerance> smaller(const Certificate& measured, const std::vector<BrickMeasure>& bricks);
  /// The texture unit takes so much that its bricks had better be classified anew, beside what it will take:
  /// raised a level at a time they come to more samples than need be.
  [[nodiscard]] bool anew() const { return anew_; }

  /// Bricks were raised for the texture unit's sake, of this volume or one before.
  [[nodiscard]] bool raised_for_image3d() const { return raised_for_image3d_; }
  /// From now on volumes are held to the buffer alone.
  void give_up_image3d();

 private:
  [[nodiscard]] SamplerTerms terms(const Crew::Kind& kind, const FieldSlopes& slopes,
                                   std::int64_t atlas) const;
  [[nodiscard]] double left(double taken, double epsilon_abs) const;
  [[nodiscard]] double left_or_throw(double taken, double epsilon_abs) const;
  // What nodes and the texture unit may err by in a brick together.
  [[nodiscard]] double room_of(std::size_t brick) const;
  [[nodiscard]] bool has_room_for_image3d(const Certificate& measured) const;
  std::optional<NodeTolerance> smaller_for_coarse(const Certificate& measured,
                                                  const std::vector<BrickMeasure>& bricks);

  const std::vector<Crew::Kind>& kinds_;
  const Plan& plan_;
  Units units_;
  double epsilon_abs_, arithmetic_, reserved_ = 0;
  std::vector<double> bounds_;
  NodeTolerance start_{0};  // what volumes are begun with
  double now_ = 0;          // and brought within, all bricks
  bool charges_, wants_image3d_ = true, raised_for_image3d_ = false, anew_ = false,
                 coarse_ = false;  // some texture unit has weights of few bits
  bool begun_anew_ = false;
  int times_ = 0;
};

}  // namespace vdvr
