// The choices that only a comparison with the paper needs. They are a part of a plan's settings; make_plan
// and build read them there and nowhere else.
#pragma once

namespace vdvr {

/// What is stored: samples fitted to the trilinear filter, or F at the nodes, as in the paper.
enum class Coefficients { midrange, sampled };
/// The errors that a tolerance must cover: all, or |V - gold| alone, as in the paper.
enum class Terms { all, grid };
/// How bricks of different levels meet (docs/error-bounds.md, sections on closing). `none` leaves the field
/// discontinuous.
enum class Closing { coarse, paper, none };

struct Comparison {
  Coefficients coefficients = Coefficients::midrange;
  Terms terms = Terms::all;
  Closing closing = Closing::coarse;
  /// A relative tolerance is of max |F| over covered samples, as in the paper, not of the reference range.
  bool epsilon_of_max = false;

  /// Whether nothing can be certified of such a volume: it is to compare with, and carries no certificate.
  [[nodiscard]] constexpr bool is_never_certified() const {
    return terms == Terms::grid || closing == Closing::none;
  }
};

/// As --coefficients, --terms and --closing call them.
constexpr const char* text_of(Coefficients c) { return c == Coefficients::midrange ? "midrange" : "sampled"; }
constexpr const char* text_of(Terms t) { return t == Terms::all ? "all" : "grid"; }
constexpr const char* text_of(Closing c) {
  return c == Closing::coarse ? "coarse" : c == Closing::paper ? "paper" : "none";
}

}  // namespace vdvr
