// Intervals of pixels: what they must do beside holding the ideal picture
// (tests/attack/pixel_attack_test.cpp).
#define BOOST_TEST_MODULE pixel_bounds
#include <boost/test/unit_test.hpp>

#include "host/picture/pixel/range_table.hpp"
#include "tests/support/pixel_attack.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using support::device;

namespace {

// What an end is widened by for rounding, at most: u / 2 a part and 20 u of the share that it takes; and once
// the background's, the last sum's (docs/pixel-bounds.md, theorem 6).
constexpr double a_part = 20.5 * support::u, once = 12 * support::u;

double wave(double x, double y, double z) {
  return 0.5 + 0.3 * std::sin(0.5 * x) * std::cos(0.4 * y) + 0.2 * std::sin(0.3 * z);
}
MixedVolume waves() {
  return support::sampled_mixed(fields::centred_grid({20, 20, 20}), 4, 4, {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}},
                                3, wave);
}

RenderOptions unlit(const Grid& grid, const TransferFunction& transfer) {
  RenderOptions o;
  o.width = o.height = 24;
  o.camera = orbit_camera(grid, 33, 19, 1);
  o.transfer = transfer;
  o.shading = false;
  o.sampler = SamplerKind::buffer;
  return o;
}

const TransferFunction kSoft{"soft", {{0.1, {0.1, 0.2, 0.9}, 0}, {0.9, {1, 0.8, 0.2}, 0.2}}};
const TransferFunction kJump{
    "jump", {{0, {0, 0, 1}, 0}, {0.5, {0, 0, 1}, 0}, {0.5, {1, 0.5, 0}, 0.8}, {1, {1, 1, 0}, 0.8}}};

std::vector<float> all(const MixedVolume& v, float e) {
  return std::vector<float>(static_cast<std::size_t>(v.brick_count()), e);
}

double widest(const PixelBounds& b) {
  double w = 0;
  for (std::size_t i = 0; i < b.lo.values.size(); ++i)
    w = std::max(w, static_cast<double>(b.hi.values[i]) - static_cast<double>(b.lo.values[i]));
  return w;
}

/// The part of a's intervals that lies outside b's, at most.
double outside(const PixelBounds& a, const PixelBounds& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.lo.values.size(); ++i)
    most = std::max({most, static_cast<double>(b.lo.values[i] - a.lo.values[i]),
                     static_cast<double>(a.hi.values[i] - b.hi.values[i])});
  return most;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_known_field_leaves_no_width_but_that_of_parts) {
  const MixedVolume v = waves();
  const ResidentVolume resident(device(), v);
  const RenderOptions o = unlit(v.grid, kSoft);
  double before = 1;
  for (const double kappa : {8.0, 1.0, 0.125}) {
    CertifyPictureOptions c;
    c.kappa = kappa;
    // Parts follow e: one of 2^-9 needs 64 parts at most here.
    const PixelBounds b = certify_pixels(device(), resident, all(v, 0x1p-9f), o, c);
    BOOST_TEST(widest(b) < before);
    before = widest(b);
  }
  // Known exactly, a slow field leaves next to nothing. It moves by 0.01 a cell, on a piece by sqrt(3) of
  // that, and each of 64 parts has a 64th, two bins of 2^-14 of the transfer function's 0.8, and rounding
  // below a bin. The width is, to first order, the integral of T |tau' (c - W) + tau c'| times that: tau' is
  // below 0.25 / 0.8, c - W below 0.9, a ray below 20 sqrt(3) cells, the integral of T tau below 1, c' below
  // 0.9 / 0.8.
  const Grid grid = fields::centred_grid({20, 20, 20});
  const MixedVolume slow =
      as_mixed(fields::uniform(grid, [](double x, double, double) { return 0.4 + 0.01 * x; }));
  const ResidentVolume known(device(), slow);
  const PixelBounds exact = certify_pixels(device(), known, all(slow, 0), unlit(grid, kSoft));
  // Each end is moved for rounding: a ray meets 3 x 20 cells at most, and its parts together take no larger
  // share than their extinctions' sum.
  const double root = std::sqrt(3.0), moves = 0.01 * root / 64 + 3 * 0.8 * 0x1p-14;
  BOOST_TEST(widest(exact) < moves * (0.25 / 0.8 * 0.9 * 20 * root + 0.9 / 0.8) +
                                 2 * (support::u * (60 * 64 / 2 - 20 * std::log(0.8) * 20 * root) + once));
}

BOOST_AUTO_TEST_CASE(wider_bounds_hold_narrower_ones_on_the_same_parts) {
  const MixedVolume v = waves();
  const ResidentVolume resident(device(), v);
  for (const TransferFunction& f : {kSoft, kJump}) {
    const RenderOptions o = unlit(v.grid, f);
    CertifyPictureOptions c;
    c.box = true;  // joint steps are not monotone
    c.theta = 0x1p-40;
    c.kappa = 1024;  // one part a piece, whatever e
    PixelBounds inner = certify_pixels(device(), resident, all(v, 0.01f), o, c);
    for (const float e : {0.02f, 0.05f, 0.2f}) {
      PixelBounds outer = certify_pixels(device(), resident, all(v, e), o, c);
      // Either has its own allowance for rounding, of its own parts.
      BOOST_TEST(outside(inner, outer) <= a_part * 200 + once);
      inner = std::move(outer);
    }
  }
}

BOOST_AUTO_TEST_CASE(termination_and_one_pass_give_no_narrower_intervals) {
  const MixedVolume v = waves();
  const ResidentVolume resident(device(), v);
  const RenderOptions o = unlit(v.grid, kJump);
  CertifyPictureOptions whole, ended, fast;
  whole.box = ended.box = true;
  whole.theta = 0x1p-40;
  fast.fast = true;
  const auto bounds = all(v, 0.03f);
  const PixelBounds a = certify_pixels(device(), resident, bounds, o, whole),
                    b = certify_pixels(device(), resident, bounds, o, ended),
                    c = certify_pixels(device(), resident, bounds, o, fast);
  BOOST_TEST(outside(a, b) <= a_part * 500 + once);
  BOOST_TEST(outside(b, a) <= ended.theta + a_part * 500 + once);
  BOOST_TEST(outside(a, c) <= a_part * 500 + once);
}

BOOST_AUTO_TEST_CASE(joint_steps_give_narrower_intervals_and_none_that_are_wider) {
  const MixedVolume v = waves();
  const ResidentVolume resident(device(), v);
  const auto bounds = all(v, 0.03f);
  CertifyPictureOptions box, joint;
  box.theta = joint.theta = 0x1p-40;
  box.box = true;
  // So many bends that a part has more than are looked at one by one.
  TransferFunction bent{"bent", {}};
  for (int i = 0; i <= 100; ++i) {
    const double value = 0.01 * i;
    bent.points.push_back({value, {value, 1 - value, 0.5}, 0.3 * value * value});
  }
  for (const TransferFunction& f : {kSoft, kJump, transfer_preset("default", 0, 1), bent}) {
    const RenderOptions o = unlit(v.grid, f);
    const PixelBounds a = certify_pixels(device(), resident, bounds, o, box),
                      b = certify_pixels(device(), resident, bounds, o, joint);
    const std::uint32_t most = *std::max_element(a.parts.begin(), a.parts.end());
    const double rounding = 2 * (a_part * static_cast<double>(most) + once);
    BOOST_TEST(outside(b, a) <= rounding);
    double narrower = 0, width = 0;
    for (std::size_t i = 0; i < a.lo.values.size(); ++i) {
      const double of_box = static_cast<double>(a.hi.values[i] - a.lo.values[i]);
      narrower += of_box - static_cast<double>(b.hi.values[i] - b.lo.values[i]);
      width += of_box;
    }
    BOOST_TEST_MESSAGE(f.name << ": joint steps are narrower by " << 100 * narrower / width << " %");
    // At a jump a value is on either side whatever its colour: tau and c apart lose little. Else more than
    // rounding could make of either end of every interval.
    if (f.name != "jump") BOOST_TEST(narrower > 2 * rounding * static_cast<double>(a.lo.values.size()));
  }
}

// A part's values meet no bend of the transfer function, some, or more than are looked at one by one. What
// shows most lies between two that show less.
BOOST_AUTO_TEST_CASE(a_part_with_many_bends_holds_what_they_show) {
  const MixedVolume v = waves();
  const ResidentVolume resident(device(), v);
  const auto bounds = all(v, 0.06f);
  for (const int bends : {4, 12, 25, 100}) {
    TransferFunction f{"zigzag", {}};
    std::mt19937 random(static_cast<unsigned>(bends));
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i <= bends; ++i)
      f.points.push_back({static_cast<double>(i) / bends,
                          {unit(random), unit(random), unit(random)},
                          i % 3 == 0 ? 0 : 0.4 * unit(random)});
    const RenderOptions o = unlit(v.grid, f);
    const PixelBounds b = certify_pixels(device(), resident, bounds, o);
    const double rounding = support::path_rounding(o, v.grid);
    double reached = 0, width = 0;
    for (std::int64_t y = 2; y < 24; y += 3)
      for (std::int64_t x = 2; x < 24; x += 3) {
        const auto steps = support::steps_of(v, bounds, o, x, y, 32);
        const auto behind = reference::background_of(o, y);
        const auto i = 3 * static_cast<std::size_t>(y * 24 + x);
        for (std::size_t c = 0; c < 3; ++c) {
          const double up = support::adversary(steps, f.points, behind, c, true)[c],
                       down = support::adversary(steps, f.points, behind, c, false)[c],
                       hi = static_cast<double>(b.hi.values[i + c]),
                       lo = static_cast<double>(b.lo.values[i + c]);
          BOOST_TEST(up <= hi + rounding);
          BOOST_TEST(down >= lo - rounding);
          reached += up - down;
          width += hi - lo;
        }
      }
    BOOST_TEST_MESSAGE(bends << " bends: an adversary reaches " << 100 * reached / width << " %");
  }
}

BOOST_AUTO_TEST_CASE(rays_end_later_where_bounds_are_small) {
  const MixedVolume v = waves();
  BOOST_TEST(ending_share(0x1p-10, all(v, 0.1f), kJump) == 0x1p-10);
  BOOST_TEST(ending_share(0x1p-10, all(v, 0x1p-9f), kJump) == 0x1p-13);
  BOOST_TEST(ending_share(0x1p-20, all(v, 0x1p-9f), kJump) == 0x1p-20);
  BOOST_TEST(ending_share(0x1p-10, all(v, std::numeric_limits<float>::infinity()), kJump) == 0x1p-10);
  BOOST_TEST(ending_share(0x1p-10, {}, kJump) == 0x1p-10);
}

// A part's range holds those of the parts that it is cut into, and the box step is monotone in ranges.
BOOST_AUTO_TEST_CASE(fewer_parts_give_no_narrower_intervals) {
  // Noise from node to node: inside a cell V falls below, and rises above, what it is where rays pass its
  // faces.
  const Grid grid = fields::centred_grid({12, 12, 12});
  std::mt19937 random(5);
  const MixedVolume v = as_mixed(
      fields::uniform(grid, [&](double, double, double) { return static_cast<double>(random() % 2); }));
  const ResidentVolume resident(device(), v);
  CertifyPictureOptions fine, coarse;
  fine.box = coarse.box = true;
  fine.kappa = 0.5;
  coarse.kappa = 1024;
  // What the cut to parts rounds by is in e.
  const auto bounds = all(v, 0x1p-6f), wider = all(v, 0x1p-6f + 0x1p-12f);
  for (const bool low : {true, false}) {
    const TransferFunction shown{"ends", {{0.3, {1, 1, 1}, low ? 0.5 : 0}, {0.7, {1, 1, 1}, low ? 0 : 0.5}}};
    const RenderOptions o = unlit(grid, shown);
    const PixelBounds a = certify_pixels(device(), resident, bounds, o, fine),
                      b = certify_pixels(device(), resident, wider, o, coarse);
    const std::uint32_t most = *std::max_element(a.parts.begin(), a.parts.end());
    BOOST_TEST(most > 4 * *std::max_element(b.parts.begin(), b.parts.end()));
    BOOST_TEST(outside(a, b) <= a_part * static_cast<double>(most) + once, (low ? "low" : "high"));
  }
}

BOOST_AUTO_TEST_CASE(what_may_be_clear_ends_no_ray) {
  // F is 0.49 to 0.57: clear below a half, white above, and nothing of it is black.
  const Grid grid = fields::centred_grid({16, 16, 16});
  const MixedVolume v = as_mixed(fields::uniform(grid, [](double, double, double) { return 0.53; }));
  const ResidentVolume resident(device(), v);
  RenderOptions o = unlit(grid, {"three",
                                 {{0, {1, 1, 1}, 0},
                                  {0.5, {1, 1, 1}, 0},
                                  {0.5, {1, 1, 1}, 0.8},
                                  {0.8, {1, 1, 1}, 0.8},
                                  {0.8, {0, 0, 0}, 0.8},
                                  {1, {0, 0, 0}, 0.8}}});
  o.background_top = o.background_bottom = {0.5, 0.5, 0.5};
  const PixelBounds b = certify_pixels(device(), resident, all(v, 0.04f), o);
  const std::size_t centre = 12 * 24 + 12;
  BOOST_TEST(static_cast<double>(b.lo.values[3 * centre]) >=
             0.5 - a_part * static_cast<double>(b.parts[centre]) - once);
  BOOST_TEST(b.hi.values[3 * centre] > 0.99f);
}

BOOST_AUTO_TEST_CASE(fog_of_f_where_v_is_clear_is_in_the_interval) {
  const Grid grid = fields::centred_grid({16, 16, 16});
  const MixedVolume v = as_mixed(fields::uniform(grid, [](double, double, double) { return 0.45; }));
  const ResidentVolume resident(device(), v);
  RenderOptions o = unlit(grid, kJump);
  const PixelBounds clear = certify_pixels(device(), resident, all(v, 0.04f), o),
                    fog = certify_pixels(device(), resident, all(v, 0.06f), o);
  const std::size_t centre = 3 * (12 * 24 + 12);
  // The background and what rounds it, to either side.
  BOOST_TEST(static_cast<double>(clear.hi.values[centre]) - static_cast<double>(clear.lo.values[centre]) <=
             2 * once);
  BOOST_TEST(fog.hi.values[centre] > 0.99f);  // the colour beside the jump, through 16 cells of 0.8
  BOOST_TEST(clear.parts[12 * 24 + 12] == 0);
}

BOOST_AUTO_TEST_CASE(untested_bricks_count_and_the_interval_is_all_colours) {
  const MixedVolume v = waves();
  const ResidentVolume resident(device(), v);
  const PixelBounds b = certify_pixels(device(), resident, all(v, std::numeric_limits<float>::infinity()),
                                       unlit(v.grid, kSoft));
  const std::size_t centre = 12 * 24 + 12;
  BOOST_TEST(b.untested[centre] == 1);
  BOOST_TEST(b.hi.values[3 * centre] > 0.95f);
  BOOST_TEST(b.untested[0] == 0);  // beside the volume
}

BOOST_AUTO_TEST_CASE(with_a_window_any_point_may_be_clear_and_untested_bricks_are) {
  const Grid grid = fields::centred_grid({16, 16, 16});
  const MixedVolume v = as_mixed(fields::uniform(grid, [](double, double, double) { return 0.5; }));
  const ResidentVolume resident(device(), v);
  const RenderOptions o =
      unlit(grid, {"band", {{0.3, {1, 1, 1}, 0}, {0.5, {1, 1, 1}, 0.9}, {0.7, {1, 1, 1}, 0}}});
  CertifyPictureOptions whole, window;
  window.window = std::pair{0.3, 0.7};
  const std::size_t centre = 3 * (12 * 24 + 12);
  const PixelBounds known = certify_pixels(device(), resident, all(v, 0.01f), o, whole),
                    maybe = certify_pixels(device(), resident, all(v, 0.01f), o, window),
                    outer = certify_pixels(device(), resident, all(v, std::numeric_limits<float>::infinity()),
                                           o, window);
  BOOST_TEST(known.lo.values[centre] > 0.99f);
  // From the background, were F outside the window all along, to the colour.
  const float background = outer.hi.values[centre];
  BOOST_TEST(background < 0.2f);
  BOOST_TEST(maybe.lo.values[centre] <= background);
  BOOST_TEST(maybe.hi.values[centre] > 0.99f);
  BOOST_TEST(outer.untested[centre / 3] == 0);
  BOOST_TEST(outer.parts[centre / 3] == 0);
  window.window = std::pair{0.3, 0.6};
  BOOST_CHECK_THROW((void)certify_pixels(device(), resident, all(v, 0.01f), o, window), InputError);
}

BOOST_AUTO_TEST_CASE(what_a_transfer_function_shows_outside_a_window_is_told) {
  const auto clear = [](std::vector<TransferPoint> points) {
    return is_clear_outside({"f", std::move(points)}, {0.2, 0.6});
  };
  BOOST_TEST(clear({{0.2, {1, 1, 1}, 0}, {0.4, {1, 1, 1}, 1}, {0.6, {1, 1, 1}, 0}}));
  BOOST_TEST(clear({{0, {1, 1, 1}, 0},
                    {0.2, {1, 1, 1}, 0},
                    {0.2, {1, 1, 1}, 1},
                    {0.6, {1, 1, 1}, 1},
                    {0.6, {1, 1, 1}, 0}}));
  BOOST_TEST(!clear({{0.1, {1, 1, 1}, 0}, {0.4, {1, 1, 1}, 1}, {0.6, {1, 1, 1}, 0}}));
  BOOST_TEST(!clear({{0.2, {1, 1, 1}, 0}, {0.4, {1, 1, 1}, 1}, {0.7, {1, 1, 1}, 0}}));
  BOOST_TEST(!clear({{0.2, {1, 1, 1}, 0}, {0.4, {1, 1, 1}, 1}}));  // its last value goes on
  BOOST_TEST(!clear({{0.3, {1, 1, 1}, 0.1}, {0.4, {1, 1, 1}, 0}}));
}

// How much of the interval fields within the bounds reach: docs/pixel-bounds.md promises 65 % at kappa 1/2,
// 80 % at 1/8 in the mean.
BOOST_AUTO_TEST_CASE(an_adversary_reaches_most_of_the_interval) {
  const Grid grid = fields::centred_grid({24, 24, 24});
  const MixedVolume v = as_mixed(fields::uniform(grid, [](double x, double y, double z) {
    return 0.5 + 0.25 * std::sin(0.35 * x) * std::cos(0.3 * y) + 0.2 * std::sin(0.25 * z);
  }));
  const ResidentVolume resident(device(), v);
  const RenderOptions o = unlit(grid, transfer_preset("default", 0, 1));
  const auto bounds = all(v, 0.03f);
  for (const auto& [kappa, promised] : {std::pair{0.5, 0.65}, {0.125, 0.8}}) {
    CertifyPictureOptions c;
    c.kappa = kappa;
    const PixelBounds b = certify_pixels(device(), resident, bounds, o, c);
    double sum = 0;
    int count = 0;
    for (std::int64_t y = 2; y < 24; y += 4)
      for (std::int64_t x = 2; x < 24; x += 4) {
        const auto steps = support::steps_of(v, bounds, o, x, y, 64);
        const auto behind = reference::background_of(o, y);
        const auto i = 3 * static_cast<std::size_t>(y * 24 + x);
        const double width = static_cast<double>(b.hi.values[i]) - static_cast<double>(b.lo.values[i]);
        if (width < 1.0 / 255) continue;
        const auto up = support::adversary(steps, o.transfer.points, behind, 0, true),
                   down = support::adversary(steps, o.transfer.points, behind, 0, false);
        sum += (up[0] - down[0]) / width;
        ++count;
      }
    BOOST_TEST_MESSAGE("kappa " << kappa << ": an adversary reaches " << 100 * sum / count << " %");
    BOOST_TEST(count > 8);
    BOOST_TEST(sum / count >= promised);
  }
}

BOOST_AUTO_TEST_CASE(clips_leave_what_they_cut_out) {
  const MixedVolume v = waves();
  const ResidentVolume resident(device(), v);
  RenderOptions o = unlit(v.grid, kSoft);
  o.background_top = o.background_bottom = {0.5, 0.5, 0.5};
  o.clip = Clip{};
  o.clip->radius = 6;
  o.clip->low[2] = -5;
  o.clip->high[2] = 5;
  o.step = 0x1p-6;
  o.termination = 1;
  const RenderResult drawn = raycast(device(), resident, o);
  for (std::int64_t y = 0; y < o.height; ++y)
    for (std::int64_t x = 0; x < o.width; ++x) {
      const reference::IdealRay ray = reference::ideal_ray(o, v.grid, x, y);
      const auto i = static_cast<std::size_t>(y * o.width + x);
      const double length = std::max(0.0, ray.last - ray.first);
      // 20 % a cell at most; the grazing ends of rays are as rounded as the clip.
      BOOST_TEST(static_cast<double>(drawn.values.values[i]) <= 1 - std::pow(0.8, length) + 1.0 / 255);
      if (length > 2) BOOST_TEST(drawn.values.values[i] > 0);
    }
  o.clip->low[2] = 6;
  BOOST_CHECK_THROW(raycast(device(), resident, o), InputError);
}

BOOST_AUTO_TEST_CASE(range_tables_hold_every_value_of_the_transfer_function) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-0.3, 1.3);
  for (int i = 0; i < 40; ++i) {
    const TransferFunction f = support::random_transfer(random);
    const RangeTable t = make_range_table(f, 0.05);
    for (int k = 0; k < 400; ++k) {
      const double s = unit(random);
      const TransferPoint p = reference::shown_at(f.points, s, k % 2 == 0);
      const auto at = static_cast<float>(s);
      const auto bin =
          static_cast<std::size_t>(std::clamp((at - t.lo) * t.scale, 0.0f, static_cast<float>(t.bins - 1)));
      const cl_float4 low = t.rows[2 * bin], high = t.rows[2 * bin + 1];
      // A value on the edge of a bin may round into the next: kernels look up both.
      if (std::abs((at - t.lo) * t.scale - std::nearbyint((at - t.lo) * t.scale)) < 0x1p-8f) continue;
      if (p.opacity > 0) BOOST_TEST(!t.is_clear(at, at));
      BOOST_TEST(static_cast<double>(low.s[0]) >=
                 reference::extinction(p.opacity) / std::log(2.0) * (1 - 1e-9));
      if (p.opacity > 0) BOOST_TEST(static_cast<double>(high.s[0]) >= p.rgb[2]);
      if (p.opacity > 0) BOOST_TEST(-static_cast<double>(high.s[1]) <= p.rgb[0]);
    }
  }
}

BOOST_AUTO_TEST_CASE(bins_have_the_colours_of_what_shows_and_no_others) {
  const TransferFunction f{"fog behind a gap",
                           {{0.0, {0, 0, 1}, 0},
                            {0.31, {0.2, 0.9, 0.4}, 0},
                            {0.6, {0.7, 0.1, 0.3}, 0.5},
                            {0.7, {0.7, 0.1, 0.3}, 0.5},
                            {0.7, {0.1, 1, 0.1}, 0},
                            {1.0, {0.1, 1, 0.1}, 0}}};
  const RangeTable t = make_range_table(f, 0.05);
  const auto row_at = [&](double value) {
    const auto bin = static_cast<std::size_t>((static_cast<float>(value) - t.lo) * t.scale);
    return std::pair{t.rows[2 * bin], t.rows[2 * bin + 1]};
  };
  for (const double clear : {0.1, 0.3, 0.8, 0.95}) {
    const auto [low, high] = row_at(clear);
    BOOST_TEST(low.s[0] == 0);
    for (const float colour : {low.s[2], low.s[3], high.s[0], high.s[1], high.s[2], high.s[3]})
      BOOST_TEST(colour == -std::numeric_limits<float>::infinity());
  }
  // Opacity begins in this bin, whose colour is that of the point where it is still 0.
  const auto [low, high] = row_at(0.31);
  BOOST_TEST(low.s[0] > 0);
  BOOST_TEST(static_cast<double>(low.s[3]) >= 0.9);
  BOOST_TEST(static_cast<double>(low.s[3]) < 0.91);
  BOOST_TEST(static_cast<double>(-high.s[1]) <= 0.2);
}
