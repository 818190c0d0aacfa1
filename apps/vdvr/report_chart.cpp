#include "apps/vdvr/report_chart.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/vdvr/html.hpp"

namespace vdvr::cli {
namespace {

constexpr double width = 1000;  // of the view box; the page stretches it

double place(double value, double full) { return full > 0 ? std::clamp(value / full, 0.0, 1.0) * width : 0; }

}  // namespace

std::string stacked_bar(const std::vector<BarPart>& parts, double full, double mark,
                        const std::string& label) {
  std::string svg = fmt::format(
      "<svg class=\"bar\" role=\"img\" aria-label=\"{}\" viewBox=\"0 0 1000 20\" "
      "preserveAspectRatio=\"none\"><rect width=\"1000\" height=\"20\" fill=\"#eef0f3\"></rect>",
      escaped(label));
  double sum = 0;
  for (const BarPart& part : parts) {
    const double from = place(sum, full), to = place(sum += std::max(0.0, part.value), full);
    svg += fmt::format(
        "<rect x=\"{:.3f}\" width=\"{:.3f}\" height=\"20\" fill=\"{}\"><title>{}: {}</title></rect>", from,
        to - from, part.color, escaped(part.name), number_text(part.value));
  }
  if (mark > 0)
    svg += fmt::format("<rect x=\"{:.3f}\" width=\"2.5\" height=\"20\" fill=\"#b3261e\"></rect>",
                       std::min(place(mark, full), width - 2.5));
  return svg + "</svg>";
}

std::string legend(const std::vector<BarPart>& parts) {
  std::string html = "<p class=\"legend\">";
  for (const BarPart& part : parts)
    html += fmt::format(
        "<span><svg class=\"key\" viewBox=\"0 0 10 10\" aria-hidden=\"true\"><rect width=\"10\" "
        "height=\"10\" fill=\"{}\"></rect></svg> {}</span> ",
        part.color, escaped(part.name));
  return html + "</p>\n";
}

}  // namespace vdvr::cli
