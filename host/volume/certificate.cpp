// The certificate as JSON (docs/file-format.md): members in a fixed order, numbers that read back to the bit,
// no NaN and no infinity.
#include "vdvr/expert/certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/scan/prepare/preparation_json.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"

namespace vdvr {
namespace {

using Json = nlohmann::ordered_json;

// --- writing ---

/// JSON has no NaN and no infinity; the JSON library would write null, which reads as "not measured".
double finite(const char* member, double value) {
  if (!std::isfinite(value))
    throw InputError(
        fmt::format("certificate: member '{}' is {}; only finite numbers can be certified", member, value));
  return value;
}

Json term(const char* member, const ErrorTerm& t) {
  return {{"value", finite(member, t.value)}, {"method", t.method}};
}

Json budget(const ErrorBudget& b) {
  Json sampler = {{"buffer", term("budget.sampler.buffer.value", b.sampler.buffer)}};
  if (b.sampler.image3d) sampler["image3d"] = term("budget.sampler.image3d.value", *b.sampler.image3d);
  return {{"grid", term("budget.grid.value", b.grid)},
          {"gold", term("budget.gold.value", b.gold)},
          {"projection", term("budget.projection.value", b.projection)},
          {"arithmetic", term("budget.arithmetic.value", b.arithmetic)},
          {"sampler", sampler}};
}

/// {stage: {rate: [{method, value, rigorous}, ...]}}, stages and rates in the order of their first bound.
Json bounds(const std::vector<Bound>& all) {
  Json stages = Json::object();
  for (const Bound& b : all)
    stages[b.stage][fmt::format("{}", b.rate)].push_back(
        {{"method", b.method}, {"value", finite("bounds", b.value)}, {"rigorous", b.rigorous}});
  return stages;
}

template <class Numbers>
Json numbers(const char* member, const Numbers& values) {
  Json list = Json::array();
  for (const double v : values) list.push_back(finite(member, v));
  return list;
}

/// `worst`: by how many sigmas of its own a brick's bound is the largest, of each sampler.
Json noise(const Certificate& c) {
  const NoiseRecord& n = *c.noise;
  Json j = {{"source", n.source}};
  if (n.photons > 0) j["photons"] = finite("noise.photons", n.photons);
  j["sigma"] = {{"least", finite("noise.sigma.least", n.least)},
                {"median", finite("noise.sigma.median", n.median)},
                {"largest", finite("noise.sigma.largest", n.largest)}};
  if (n.tolerance_sigmas) j["tolerance_sigmas"] = finite("noise.tolerance_sigmas", *n.tolerance_sigmas);
  if (!c.comparison && !c.brick_totals.empty() && !c.brick_sigma.empty()) {
    j["worst"]["buffer"] = finite("noise.worst.buffer", worst_in_sigma(c, false));
    if (c.budget.sampler.image3d)
      j["worst"]["image3d"] = finite("noise.worst.image3d", worst_in_sigma(c, true));
  }
  if (n.rms_in_sigma)
    j["rms"] = {{"sigmas", finite("noise.rms.sigmas", *n.rms_in_sigma)}, {"points", n.rms_points}};
  if (n.split_ratio)
    j["split"] = {{"ratio", finite("noise.split.ratio", *n.split_ratio)}, {"resolved", n.split_resolved}};
  j["brick_sigma_sha256"] = n.sha256;
  return j;
}

Json options(const std::string& text) {
  Json parsed = Json::parse(text, nullptr, false);
  if (!parsed.is_object())
    throw InputError(fmt::format("certificate: options are not a JSON object: '{}'", text));
  return parsed;
}

// --- reading ---

/// A value with its place, so that every refusal names the member.
class Member {
 public:
  Member(const Json& value, std::string path) : value_(&value), path_(std::move(path)) {}

  [[nodiscard]] bool has(const std::string& name) const {
    return object().contains(name) && !object().at(name).is_null();
  }
  [[nodiscard]] Member at(const std::string& name) const {
    const std::string path = path_.empty() ? name : path_ + "." + name;
    if (!object().contains(name)) throw FileError(fmt::format("certificate: member '{}' is missing", path));
    return {object().at(name), path};
  }
  [[nodiscard]] Member item(std::size_t i) const { return {value_->at(i), fmt::format("{}[{}]", path_, i)}; }
  [[nodiscard]] bool is_null() const { return value_->is_null(); }
  [[nodiscard]] const Json& object() const { return expect(value_->is_object(), "an object"); }
  [[nodiscard]] const Json& list() const { return expect(value_->is_array(), "an array"); }
  [[nodiscard]] double number() const { return expect(value_->is_number(), "a number").get<double>(); }
  [[nodiscard]] bool flag() const { return expect(value_->is_boolean(), "true or false").get<bool>(); }
  [[nodiscard]] std::string text() const {
    return expect(value_->is_string(), "a string").get<std::string>();
  }
  [[nodiscard]] std::int64_t integer() const {
    const bool fits = value_->is_number_integer() &&
                      (!value_->is_number_unsigned() ||
                       value_->get<std::uint64_t>() <=
                           static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()));
    return expect(fits, "a 64-bit integer").get<std::int64_t>();
  }
  [[nodiscard]] int rate() const {
    const std::int64_t n = integer();
    if (n < 1 || n > std::numeric_limits<int>::max())
      throw FileError(fmt::format("certificate: member '{}' is {}, expected a rate of at least 1", path_, n));
    return static_cast<int>(n);
  }
  /// What `parse` makes of the text, which must be one of those that `names` lists.
  template <class Parse>
  [[nodiscard]] auto choice(Parse parse, const char* names) const {
    const auto value = parse(text());
    if (!value)
      throw FileError(fmt::format("certificate: member '{}' is '{}', expected {}", path_, text(), names));
    return *value;
  }
  template <std::size_t N>
  [[nodiscard]] std::array<double, N> numbers() const {
    if (list().size() != N)
      throw FileError(
          fmt::format("certificate: member '{}' has {} entries, expected {}", path_, list().size(), N));
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i) values[i] = item(i).number();
    return values;
  }

 private:
  const Json& expect(bool right, const char* expected) const {
    if (!right)
      throw FileError(fmt::format("certificate: {} is {}, expected {}",
                                  path_.empty() ? "the JSON" : fmt::format("member '{}'", path_),
                                  value_->type_name(), expected));
    return *value_;
  }

  const Json* value_;
  std::string path_;
};

ErrorTerm read_term(const Member& m) { return {m.at("value").number(), m.at("method").text()}; }

void read_budget(const Member& m, ErrorBudget& b) {
  b.grid = read_term(m.at("grid"));
  b.gold = read_term(m.at("gold"));
  b.projection = read_term(m.at("projection"));
  b.arithmetic = read_term(m.at("arithmetic"));
  const Member sampler = m.at("sampler");
  b.sampler.buffer = read_term(sampler.at("buffer"));
  if (sampler.has("image3d")) b.sampler.image3d = read_term(sampler.at("image3d"));
}

int rate_of_name(const std::string& name, const std::string& stage) {
  std::int64_t rate = 0;
  for (const char digit : name)
    rate = digit >= '0' && digit <= '9' && rate < 100'000'000 ? 10 * rate + (digit - '0') : -1;
  if (name.empty() || rate < 1)
    throw FileError(fmt::format("certificate: member 'bounds.{}.{}' is not named by a rate", stage, name));
  return static_cast<int>(rate);
}

std::vector<Bound> read_bounds(const Member& m) {
  std::vector<Bound> all;
  for (const auto& [stage, rates] : m.object().items()) {
    const Member of_stage = m.at(stage);
    for (const auto& [rate, list] : of_stage.object().items()) {
      const Member of_rate = of_stage.at(rate);
      for (std::size_t i = 0; i < of_rate.list().size(); ++i) {
        const Member b = of_rate.item(i);
        all.push_back({stage, b.at("method").text(), rate_of_name(rate, stage), b.at("value").number(),
                       b.at("rigorous").flag()});
      }
    }
  }
  return all;
}

void read_promise(const Member& m, Certificate& c) {
  c.epsilon = m.at("epsilon").number();
  c.epsilon_abs = m.at("epsilon_abs").number();
  c.reference_range = m.at("reference_range").number();
  if (m.has("range_at"))
    c.range_at = {m.at("range_at").at("low").numbers<3>(), m.at("range_at").at("high").numbers<3>()};
  if (m.has("sealed")) c.sealed = m.at("sealed").flag();
  if (m.has("comparison")) c.comparison = m.at("comparison").flag();
  // A record of a comparison promises nothing; those of earlier versions said so in these two.
  if (!c.comparison || m.has("holds") || m.has("total")) {
    const Member holds = m.at("holds"), total = m.at("total");
    c.holds_buffer = holds.at("buffer").flag();
    if (holds.has("image3d")) c.holds_image3d = holds.at("image3d").flag();
    c.total_buffer = total.at("buffer").number();
    if (total.has("image3d")) c.total_image3d = total.at("image3d").number();
  }
  read_budget(m.at("budget"), c.budget);
  c.measured_max = m.at("measured_max").number();
  c.measured_total = m.at("measured_total").number();
  c.worst_at = m.at("worst_at").numbers<3>();
  if (c.comparison && !m.has("total")) {  // what a certificate would say, for those who look at it
    const double sum = c.measured_total + c.budget.arithmetic.value;
    c.total_buffer = sum + c.budget.sampler.buffer.value;
    if (c.budget.sampler.image3d) c.total_image3d = sum + c.budget.sampler.image3d->value;
  }
}

void read_noise(const Member& m, Certificate& c) {
  NoiseRecord& n = c.noise.emplace();
  n.source = m.at("source").text();
  if (m.has("photons")) n.photons = m.at("photons").number();
  const Member sigma = m.at("sigma");
  n.least = sigma.at("least").number();
  n.median = sigma.at("median").number();
  n.largest = sigma.at("largest").number();
  if (!(n.least > 0 && n.least <= n.median && n.median <= n.largest))
    throw FileError("certificate: member 'noise.sigma' is not positive and in order");
  if (m.has("tolerance_sigmas")) {
    n.tolerance_sigmas = m.at("tolerance_sigmas").number();
    if (!(*n.tolerance_sigmas > 0))
      throw FileError(fmt::format("certificate: member 'noise.tolerance_sigmas' is {}; it must be positive",
                                  *n.tolerance_sigmas));
  }
  if (m.has("rms")) {
    n.rms_in_sigma = m.at("rms").at("sigmas").number();
    n.rms_points = m.at("rms").at("points").integer();
    if (!(*n.rms_in_sigma >= 0 && n.rms_points > 0))
      throw FileError("certificate: member 'noise.rms' is no mean of any points");
  }
  if (m.has("split")) {
    n.split_ratio = m.at("split").at("ratio").number();
    n.split_resolved = m.at("split").at("resolved").flag();
    if (!(*n.split_ratio > 0))
      throw FileError(
          fmt::format("certificate: member 'noise.split.ratio' is {}; it must be positive", *n.split_ratio));
  }
  if (m.has("worst") && m.at("worst").has("image3d")) n.worst_image3d = m.at("worst").at("image3d").number();
  n.sha256 = m.at("brick_sigma_sha256").text();
}

// Files of earlier programs have none: theirs were dense.
int read_differences(const Member& m) {
  const std::int64_t n = m.integer();
  if (n != dense_differences && n != sparse_differences)
    throw FileError(fmt::format("certificate: member 'rates.differences' is {}, expected {} or {}", n,
                                sparse_differences, dense_differences));
  return static_cast<int>(n);
}

void read_method(const Member& m, Certificate& c) {
  const Member rates = m.at("rates"), field = m.at("field");
  c.rates.upsampling = rates.at("upsampling_u").rate();
  c.rates.interpolation =
      rates.at("u_filter").choice(interpolation_of, "linear, cubic, six-taps or eight-taps");
  c.rates.gold = rates.at("gold").rate();
  if (rates.has("differences")) c.rates.differences = read_differences(rates.at("differences"));
  c.bounds = read_bounds(m.at("bounds"));
  c.field.filter = field.at("filter").choice(ramp_window_of, "ram-lak, shepp-logan, cosine, hamming or hann");
  c.field.cutoff = field.at("cutoff").number();
  if (const Member center = field.at("center"); !center.is_null()) c.field.center = center.number();
  if (field.has("preparation")) try {
      c.field.preparation = preparation_of(field.at("preparation").object());
    } catch (const InputError& e) {
      throw FileError(fmt::format("certificate: member 'field.preparation': {}", e.what()));
    }
  c.padding = field.at("padding").integer();
}

void read_scope(const Member& m, Certificate& c) {
  if (const Member window = m.at("window"); !window.is_null()) {
    const auto w = window.numbers<2>();
    c.window = {w[0], w[1]};
  }
  if (const Member roi = m.at("roi"); !roi.is_null()) c.roi = roi.numbers<6>();
  if (m.has("covered")) {
    const Member covered = m.at("covered");
    const auto z = covered.at("z").numbers<2>();
    c.covered = CoveredCylinder{covered.at("radius").number(), {z[0], z[1]}};
    if (!(c.covered->radius > 0 && z[0] < z[1]))
      throw FileError(
          "certificate: member 'covered' is no cylinder: its radius must be above 0 and z in order");
  }
  const Member not_covered = m.at("not_covered");
  c.not_covered_count = not_covered.at("count").integer();
  c.not_covered_fraction = not_covered.at("fraction").number();
  c.not_covered_rule = not_covered.at("rule").text();
}

void read_origin(const Member& m, Certificate& c) {
  const Member input = m.at("input"), shape = input.at("shape");
  c.input_name = input.at("name").text();
  c.input_sha256 = input.at("sha256").text();
  for (std::size_t i = 0; i < shape.list().size(); ++i) c.input_shape.push_back(shape.item(i).integer());
  c.input_angles = input.at("angles").integer();
  c.content_sha256 = m.at("content_sha256").text();
  c.device = m.at("device").text();
  c.driver = m.at("driver").text();
  c.version = m.at("version").text();
  c.options_json = m.at("options").object().dump();
  if (!m.has("notes")) return;
  const Member notes = m.at("notes");
  for (std::size_t i = 0; i < notes.list().size(); ++i) c.notes.push_back(notes.item(i).text());
}

}  // namespace

std::string contradiction(const Certificate& c) {
  if (c.comparison)
    return c.holds_buffer || c.holds_image3d.value_or(false)
               ? "it was built for comparison, and yet something 'holds'"
               : "";
  const bool image_fits = !c.total_image3d || !c.holds_image3d || !c.budget.sampler.image3d ||
                          *c.holds_image3d == within_tolerance(c, *c.total_image3d, true);
  if (c.holds_buffer != within_tolerance(c, c.total_buffer, false) || !image_fits)
    return fmt::format(
        "'holds' does not follow from total and epsilon_abs {}{}", c.epsilon_abs,
        c.noise && c.noise->tolerance_sigmas ? ", or not from the bounds and sigma of bricks" : "");
  // Written with all digits: what differs in the tenth was not written together.
  const auto same = [](double a, double b) {
    return std::abs(a - b) <= 1e-10 * std::max(std::abs(a), std::abs(b));
  };
  if (c.reference_range > 0 && !same(c.epsilon * c.reference_range, c.epsilon_abs))
    return fmt::format("epsilon_abs {} is not epsilon {} of the reference range {}", c.epsilon_abs, c.epsilon,
                       c.reference_range);
  const double sum = c.measured_total + c.budget.arithmetic.value;
  if (!same(c.total_buffer, sum + c.budget.sampler.buffer.value))
    return fmt::format("total {} of the buffer sampler is not measured_total, arithmetic and sampler",
                       c.total_buffer);
  if (c.total_image3d && c.budget.sampler.image3d &&
      !same(*c.total_image3d, sum + c.budget.sampler.image3d->value))
    return fmt::format("total {} of the image3d sampler is not measured_total, arithmetic and sampler",
                       *c.total_image3d);
  return {};
}

namespace {

// What a bound of a brick holds beside the brick's total.
double beside_total(const Certificate& c, std::size_t brick, bool image3d) {
  const SamplerTerms& sampler = c.budget.sampler;
  return c.budget.arithmetic.value +
         (image3d ? static_cast<double>(sampler.image3d_by_brick[brick]) : sampler.buffer.value);
}

}  // namespace

double worst_in_sigma(const Certificate& c, bool image3d) {
  if (image3d && c.budget.sampler.image3d_by_brick.empty())
    return c.noise ? c.noise->worst_image3d.value_or(0) : 0;
  double worst = 0;
  for (std::size_t i = 0; i < std::min(c.brick_totals.size(), c.brick_sigma.size()); ++i)
    if (c.brick_totals[i] >= 0)
      worst = std::max(worst, (static_cast<double>(c.brick_totals[i]) + beside_total(c, i, image3d)) /
                                  static_cast<double>(c.brick_sigma[i]));
  return worst;
}

bool within_tolerance(const Certificate& c, double total, bool image3d) {
  if (!(total <= c.epsilon_abs)) return false;
  return !c.noise || !c.noise->tolerance_sigmas || worst_in_sigma(c, image3d) <= *c.noise->tolerance_sigmas;
}

void charge_samplers(Certificate& c, SamplerTerms samplers) {
  c.budget.sampler = std::move(samplers);
  const double sum = c.measured_total + c.budget.arithmetic.value;
  c.total_buffer = sum + c.budget.sampler.buffer.value;
  c.total_image3d.reset();
  if (!c.budget.sampler.image3d) return;
  const std::vector<float>& by_brick = c.budget.sampler.image3d_by_brick;
  double largest = by_brick.empty() ? c.measured_total + c.budget.sampler.image3d->value : 0;
  for (std::size_t i = 0; i < by_brick.size(); ++i) {
    // Files of earlier versions have no totals by brick.
    const double total =
        c.brick_totals.empty() ? c.measured_total : static_cast<double>(c.brick_totals.at(i));
    if (total >= 0) largest = std::max(largest, total + static_cast<double>(by_brick[i]));
  }
  const double above = std::max(0.0, largest - c.measured_total);
  c.budget.sampler.image3d->value = above;
  c.total_image3d = sum + above;
}

std::string sigma_sha256(const std::vector<float>& brick_sigma) {
  Sha256 hash;
  hash.update(brick_sigma.data(), brick_sigma.size() * sizeof(float));
  return hash.hex();
}

std::string to_json(const Certificate& c) {
  Json j;
  j["epsilon"] = finite("epsilon", c.epsilon);
  j["epsilon_abs"] = finite("epsilon_abs", c.epsilon_abs);
  j["reference_range"] = finite("reference_range", c.reference_range);
  if (c.range_at)
    j["range_at"] = {{"low", numbers("range_at.low", (*c.range_at)[0])},
                     {"high", numbers("range_at.high", (*c.range_at)[1])}};
  if (c.sealed) j["sealed"] = true;
  if (c.comparison) j["comparison"] = true;
  if (!c.comparison) {
    j["holds"] = {{"buffer", c.holds_buffer}};
    if (c.holds_image3d) j["holds"]["image3d"] = *c.holds_image3d;
    j["total"] = {{"buffer", finite("total.buffer", c.total_buffer)}};
    if (c.total_image3d) j["total"]["image3d"] = finite("total.image3d", *c.total_image3d);
  }
  j["budget"] = budget(c.budget);
  j["measured_max"] = finite("measured_max", c.measured_max);
  j["measured_total"] = finite("measured_total", c.measured_total);
  j["worst_at"] = numbers("worst_at", c.worst_at);
  if (c.noise) j["noise"] = noise(c);
  j["rates"] = {{"upsampling_u", c.rates.upsampling},
                {"u_filter", text_of(c.rates.interpolation)},
                {"gold", c.rates.gold}};
  if (c.rates.interpolation == Interpolation::eight_taps) j["rates"]["differences"] = c.rates.differences;
  j["bounds"] = bounds(c.bounds);
  j["field"] = {{"filter", text_of(c.field.filter)}, {"cutoff", finite("field.cutoff", c.field.cutoff)}};
  j["field"]["center"] = c.field.center ? Json(finite("field.center", *c.field.center)) : Json(nullptr);
  j["field"]["padding"] = c.padding;
  if (!c.field.preparation.none()) j["field"]["preparation"] = json_of(c.field.preparation);
  j["window"] = c.window ? numbers("window", std::array{c.window->first, c.window->second}) : Json(nullptr);
  j["roi"] = c.roi ? numbers("roi", *c.roi) : Json(nullptr);
  if (c.covered)
    j["covered"] = {{"radius", finite("covered.radius", c.covered->radius)},
                    {"z", numbers("covered.z", std::array{c.covered->z.first, c.covered->z.second})}};
  j["not_covered"] = {{"count", c.not_covered_count},
                      {"fraction", finite("not_covered.fraction", c.not_covered_fraction)},
                      {"rule", c.not_covered_rule}};
  j["input"] = {{"name", c.input_name},
                {"sha256", c.input_sha256},
                {"shape", c.input_shape},
                {"angles", c.input_angles}};
  j["content_sha256"] = c.content_sha256;
  j["device"] = c.device;
  j["driver"] = c.driver;
  j["version"] = c.version;
  j["options"] = options(c.options_json);
  j["notes"] = c.notes;
  // File names need not be UTF-8; JSON must be.
  return j.dump(2, ' ', false, Json::error_handler_t::replace);
}

Certificate certificate_from_json(const std::string& text) {
  Json parsed;
  try {
    parsed = Json::parse(text);
  } catch (const nlohmann::json::exception& e) {
    throw FileError(fmt::format("certificate: not valid JSON: {}", e.what()));
  }
  const Member m(parsed, "");
  Certificate c;
  read_promise(m, c);
  if (m.has("noise")) read_noise(m.at("noise"), c);
  read_method(m, c);
  read_scope(m, c);
  read_origin(m, c);
  return c;
}

std::vector<float> brick_bounds(const Certificate& c, bool image3d) {
  if (c.brick_totals.empty())
    throw InputError(
        "the file has no bounds by brick: an earlier version wrote it, or nothing is certified; build it "
        "again");
  if (image3d && c.budget.sampler.image3d_by_brick.size() != c.brick_totals.size())
    throw InputError(
        "the certificate says nothing of the image3d sampler of this device; take `sampler` buffer");
  constexpr float infinity = std::numeric_limits<float>::infinity();
  std::vector<float> bounds(c.brick_totals.size(), infinity);
  for (std::size_t i = 0; i < bounds.size(); ++i)
    if (const auto total = static_cast<double>(c.brick_totals[i]); total >= 0)
      bounds[i] = std::nextafter(static_cast<float>(total + beside_total(c, i, image3d)), infinity);
  return bounds;
}

}  // namespace vdvr
