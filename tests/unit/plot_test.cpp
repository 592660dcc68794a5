// SPDX-License-Identifier: Apache-2.0
#include "recording/plot/plot.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "kernel/process.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using recording::PlotRequest;
using recording::Recording;
using test::unwrap;

std::size_t times_within(const std::string& in, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = in.find(what); at != std::string::npos; at = in.find(what, at + 1)) ++n;
  return n;
}

Recording plotted_recording() {
  Recording r;
  r.title = "a <small> one";
  r.dof = 2;
  r.columns = {{"time", "s", "", {0, 0.1, 0.2}},
               {"tau1", "N m", "", {1, -2.5, 1e-17}, -3, 3},
               {"tau2", "N m", "", {0, 0.30000000000000004, 3}, -9, 9},
               {"x", "m", "", {0.5, 0.6, 0.7}},
               {"y", "m", "", {0.5, 0.9, 0.7}},
               {"z", "m", "", {0.5, 0.5, 0.5}}};
  return r;
}

PlotRequest of(const Recording& r, std::vector<std::string> columns) {
  PlotRequest request;
  request.recordings = {&r};
  request.columns = std::move(columns);
  return request;
}

TEST(Plots, SvgHasOneCurveAColumnAndOnePanelAUnit) {
  const Recording r = plotted_recording();
  const std::string svg = recording::to_svg(unwrap(recording::plot(of(r, {"tau", "x"}))));
  EXPECT_NE(svg.find("a &lt;small&gt; one"), std::string::npos);
  EXPECT_EQ(times_within(svg, "stroke-linejoin"), 3U);
  EXPECT_NE(svg.find("tau [N m]"), std::string::npos);
  EXPECT_NE(svg.find(">x [m]<"), std::string::npos);
  EXPECT_NE(svg.find(">time [s]<"), std::string::npos);
}

TEST(Plots, ColumnsOfDifferentLimitsGetPanelsWithBandsOfTheirOwn) {
  const Recording r = plotted_recording();
  PlotRequest request = of(r, {"tau"});
  EXPECT_EQ(unwrap(recording::plot(request)).panels.size(), 1U);
  request.limits = true;
  const recording::Plot p = unwrap(recording::plot(request));
  ASSERT_EQ(p.panels.size(), 2U);
  EXPECT_EQ(p.panels[0].upper, 3);
  EXPECT_EQ(p.panels[1].lower, -9);
  // Two bands a panel, and a dashed line at each limit.
  EXPECT_EQ(times_within(recording::to_svg(p), "fill-opacity=\"0.1\""), 4U);
  EXPECT_EQ(times_within(recording::to_svg(p), "stroke-dasharray"), 4U);
}

TEST(Plots, OtherRecordingsAreDashedInTheColourOfTheColumn) {
  const Recording r = plotted_recording();
  Recording other = r;
  other.title = "as measured";
  other.columns[0].values = {0, 0.2, 0.4};
  PlotRequest request = of(r, {"tau"});
  request.recordings.push_back(&other);
  const recording::Plot p = unwrap(recording::plot(request));
  ASSERT_EQ(p.panels.at(0).lines.size(), 4U);
  EXPECT_EQ(p.panels[0].lines[2].colour, p.panels[0].lines[3].colour);
  EXPECT_EQ(p.panels[0].lines[3].source, 1U);
  EXPECT_EQ(p.panels[0].lines[3].x.back(), 0.4);
  const std::string svg = recording::to_svg(p);
  EXPECT_EQ(times_within(svg, "stroke-dasharray"), 3U);  // two curves and the legend
  EXPECT_NE(svg.find("as measured"), std::string::npos);
  other.columns[1].unit = "N";
  const auto refused = recording::plot(request);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().sentence(),
            "\"as measured\": its column \"tau1\" is in \"N\" instead of \"N m\". Draw them in two "
            "plots.");
}

TEST(Plots, RecordingsOfOneColumnAPanelAreToldApartByColour) {
  const Recording r = plotted_recording();
  std::vector<Recording> others(5, r);
  PlotRequest request = of(r, {"x"});
  for (std::size_t i = 0; i < others.size(); ++i) {
    others[i].title = "recording with a long name " + std::to_string(i);
    request.recordings.push_back(&others[i]);
  }
  const std::string svg = recording::to_svg(unwrap(recording::plot(request)));
  EXPECT_EQ(times_within(svg, "stroke-dasharray"), 0U);
  EXPECT_EQ(times_within(svg, "#2f6fb7"), 2U);  // the curve and its legend
  EXPECT_EQ(times_within(svg, "#e07b1f"), 2U);
  // The legend takes as many rows as it needs: nothing begins beyond the right edge.
  std::size_t rows = 0;
  double last = 1e9;
  for (std::size_t at = svg.find("with a long name"); at != std::string::npos;
       at = svg.find("with a long name", at + 1)) {
    const std::size_t x = svg.rfind("x=\"", at);
    const double left = std::stod(svg.substr(x + 3));
    EXPECT_LT(left, 700);
    rows += left < last;
    last = left;
  }
  EXPECT_GE(rows, 2U);
}

TEST(Plots, LongNamesAndNumbersHaveRoomBesideThePanels) {
  Recording r = plotted_recording();
  r.columns[3].name = "manipulability_of_the_left_arm";
  r.columns[3].values = {0.0141025, 0.0141026, 0.0141027};
  r.columns[4].name = "manipulability_of_the_right_arm";
  r.columns[4].values = r.columns[3].values;
  const std::string svg =
      recording::to_svg(unwrap(recording::plot(of(r, {r.columns[3].name, r.columns[4].name}))));
  // A letter of 14 pixels is less than 9 wide.
  const std::string name = ">" + r.columns[3].name + "<";
  const std::size_t at = svg.find(name), x = svg.rfind("x=\"", at);
  ASSERT_NE(at, std::string::npos);
  EXPECT_LT(std::stod(svg.substr(x + 3)) + 8.5 * static_cast<double>(name.size() - 2), 900);
  // The label of the axis stands at the left of all numbers, which end at the axis.
  const std::size_t number = svg.find(">0.0141026<"), end = svg.rfind("x=\"", number);
  ASSERT_NE(number, std::string::npos);
  EXPECT_GT(std::stod(svg.substr(end + 3)) - 9 * 8.5, 24);
}

TEST(Plots, EveryColumnCanHaveAPanelOfItsOwnScale) {
  Recording r = plotted_recording();
  PlotRequest request = of(r, {"tau"});
  const std::size_t shared = unwrap(recording::plot(request)).panels.size();
  request.each_alone = true;
  const recording::Plot plot = unwrap(recording::plot(request));
  EXPECT_GT(plot.panels.size(), shared);
  for (const auto& panel : plot.panels) {
    ASSERT_EQ(panel.lines.size(), 1U);
    EXPECT_TRUE(panel.y_label.starts_with(panel.lines.front().name)) << panel.y_label;
  }
  // The axis says what the line is: no legend beside it.
  const std::string svg = recording::to_svg(plot);
  EXPECT_EQ(times_within(svg, ">tau1<"), 0U);
  EXPECT_EQ(times_within(svg, ">tau1 ["), 1U);
}

TEST(Plots, AnAxisHasTwoNumbersAtLeast) {
  Recording r = plotted_recording();
  r.columns[1].lower = -4.45, r.columns[1].upper = 4.45;
  PlotRequest request = of(r, {"tau1"});
  request.limits = true;
  request.height = 180;
  const std::string svg = recording::to_svg(unwrap(recording::plot(request)));
  EXPECT_EQ(times_within(svg, "text-anchor=\"end\""), 5U);  // -4, -2, 0, 2, 4
  EXPECT_NE(svg.find(">-4<"), std::string::npos);
}

TEST(Plots, ColumnsBeyondTheTenthAreDashed) {
  Recording r = plotted_recording();
  for (int i = 3; i <= 12; ++i) {
    r.columns.push_back(r.columns[2]);
    r.columns.back().name = "tau" + std::to_string(i);
  }
  const std::string svg = recording::to_svg(unwrap(recording::plot(of(r, {"tau"}))));
  EXPECT_EQ(times_within(svg, "stroke-dasharray"), 4U);  // two curves and their legend
}

TEST(Plots, ACircleIsDrawnRound) {
  Recording r = plotted_recording();
  r.columns[3].values.clear();
  r.columns[4].values.clear();
  for (int i = 0; i <= 360; ++i) {
    r.columns[3].values.push_back(5 + 0.1 * std::cos(i * M_PI / 180));
    r.columns[4].values.push_back(0.1 * std::sin(i * M_PI / 180));
  }
  PlotRequest request = of(r, {"y"});
  request.x = "x";
  const std::string svg = recording::to_svg(unwrap(recording::plot(request)));
  const std::size_t at = svg.rfind("<path d=\"M", svg.find("stroke-linejoin"));
  double x_low = 1e9, x_high = -1e9, y_low = 1e9, y_high = -1e9;
  const char* s = svg.c_str() + at + 9;
  while (*s == 'M' || *s == 'L') {
    char* end = nullptr;
    const double x = std::strtod(s + 1, &end), y = std::strtod(end, &end);
    s = end;
    x_low = std::min(x_low, x), x_high = std::max(x_high, x);
    y_low = std::min(y_low, y), y_high = std::max(y_high, y);
  }
  EXPECT_GT(x_high - x_low, 100);
  EXPECT_NEAR(x_high - x_low, y_high - y_low, 0.1);  // pixels
}

TEST(Plots, ALogarithmicAxisHasEqualStepsForEqualFactors) {
  Recording r;
  r.title = "decay";
  r.columns = {{"time", "s", "", {0, 1, 2, 3}}, {"error", "m", "", {1, 1e-2, 1e-4, 1e-6}}};
  PlotRequest request = of(r, {"error"});
  request.log_y = true;
  const recording::Plot p = unwrap(recording::plot(request));
  EXPECT_EQ(p.panels.at(0).lines.at(0).y, (std::vector<double>{0, -2, -4, -6}));
  EXPECT_EQ(p.left_out, 0U);
  EXPECT_EQ(p.samples, 4U);
  const std::string svg = recording::to_svg(p);
  for (const char* mark : {">0.01<", ">0.0001<", ">1e-06<"})
    EXPECT_EQ(times_within(svg, mark), 1U) << mark;
  // The curve is straight: equal steps down for equal factors.
  const std::size_t at = svg.rfind("<path d=\"M", svg.find("stroke-linejoin"));
  std::vector<double> heights;
  const char* s = svg.c_str() + at + 9;
  while (*s == 'M' || *s == 'L') {
    char* end = nullptr;
    (void)std::strtod(s + 1, &end);
    heights.push_back(std::strtod(end, &end));
    s = end;
  }
  ASSERT_EQ(heights.size(), 4U);
  EXPECT_NEAR(heights[1] - heights[0], heights[3] - heights[2], 0.02);
  EXPECT_GT(heights[1] - heights[0], 50);
  EXPECT_NE(recording::to_text(p).find("0.0001 +"), std::string::npos) << recording::to_text(p);
}

TEST(Plots, ALogarithmicAxisLeavesOutWhatIsNotAboveZeroAndCountsIt) {
  Recording r;
  r.columns = {{"time", "s", "", {0, 1, 10, 100, 1000}},
               {"a", "m", "", {5, 0, -3, NAN, 2}, -1, 8},
               {"b", "m", "", {0, -1, -2, NAN, -0.0}}};
  PlotRequest request = of(r, {"a"});
  request.log_x = request.log_y = true;
  request.limits = true;
  const recording::Plot p = unwrap(recording::plot(request));
  // At time 0, and where it is 0 and -3; what is no number is a gap as ever.
  EXPECT_EQ(p.left_out, 3U);
  EXPECT_EQ(p.samples, 5U);
  const recording::PlotLine& line = p.panels.at(0).lines.at(0);
  EXPECT_TRUE(std::isnan(line.x[0]) && std::isnan(line.y[0]));
  EXPECT_EQ(line.x[4], 3);
  EXPECT_EQ(p.panels[0].lower, -std::numeric_limits<double>::infinity());
  EXPECT_NEAR(p.panels[0].upper, std::log10(8), 1e-15);
  const auto refusal = [&](std::vector<std::string> columns, const std::string& x) {
    PlotRequest q = of(r, std::move(columns));
    q.x = x;
    q.log_x = !x.empty();
    q.log_y = x.empty();
    const auto drawn = recording::plot(q);
    return drawn.ok() ? "" : drawn.error().sentence();
  };
  EXPECT_EQ(refusal({"b"}, ""),
            "log: no value of \"b\" is above 0, so a logarithmic axis has no place for it. Leave "
            "the column or the logarithmic axis y out.");
  EXPECT_NE(refusal({"a"}, "b").find("logarithmic axis x"), std::string::npos);
  request.is_path = true;
  EXPECT_FALSE(recording::plot(request).ok());
}

TEST(Plots, LogarithmicAxesHaveMarksFromOneEndOfTheNumbersToTheOther) {
  const auto marks = [](double low, double high) {
    Recording r;
    r.columns = {{"time", "s", "", {0, 1}}, {"v", "", "", {low, high}}};
    PlotRequest request = of(r, {"v"});
    request.log_y = true;
    const recording::Plot p = unwrap(recording::plot(request));
    const std::string svg = recording::to_svg(p);
    EXPECT_EQ(svg.find("nan"), std::string::npos) << low << " " << high;
    EXPECT_EQ(svg.find("inf"), std::string::npos) << low << " " << high;
    EXPECT_NE(recording::to_text(p).find(" +"), std::string::npos);
    return times_within(svg, "text-anchor=\"end\"");
  };
  for (const auto& [low, high] : {std::pair{1.0, 10.0},
                                  {2.1, 4.8},
                                  {1.5, 1.53},
                                  {3.0, 3.0},
                                  {1e-320, 1e308},
                                  {1e300, 1.7e308},
                                  {5e-324, 1e-323},
                                  {0.02, 700.0},
                                  {1.0, 1.0 + 1e-13}}) {
    const std::size_t n = marks(low, high);
    EXPECT_GE(n, 2U) << low << " " << high;
    EXPECT_LE(n, 13U) << low << " " << high;
  }
}

TEST(Plots, APathHasThreeShadows) {
  const Recording r = plotted_recording();
  PlotRequest request = of(r, {});
  request.is_path = true;
  const recording::Plot p = unwrap(recording::plot(request));
  EXPECT_EQ(p.z_label, "z [m]");
  EXPECT_EQ(times_within(recording::to_svg(p), "stroke-opacity=\"0.4\""), 3U);
  request.columns = {"x"};
  const auto refused = recording::plot(request);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("needs three columns, 1 is given"), std::string::npos);
}

TEST(Plots, TextHasEachCurveAtItsPlace) {
  Recording r;
  r.title = "ramp";
  r.columns = {{"time", "s", "", {}}, {"x", "m", "", {}}, {"y", "m", "", {}}};
  for (int i = 0; i <= 50; ++i) {
    r.columns[0].values.push_back(i * 0.1);
    r.columns[1].values.push_back(i * 0.1);
    r.columns[2].values.push_back(0);
  }
  const std::string text = recording::to_text(unwrap(recording::plot(of(r, {"x", "y"}))), 60);
  std::vector<std::string> lines;
  for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    lines.push_back(text.substr(at, end - at));
  ASSERT_GE(lines.size(), 20U);
  EXPECT_EQ(lines[0], "ramp");
  // 15 rows for 0..6 m: the end of the ramp, 5 m, is in row (6 - 5) / 6 * 14 = 2.33 from above.
  EXPECT_EQ(lines[2 + 2].back(), '*');
  EXPECT_EQ(lines[2 + 14].find_first_of('+', 12), 12U);
  EXPECT_EQ(lines[2 + 14].back(), '+');
  EXPECT_NE(text.find("* x   + y"), std::string::npos);
  for (const std::string& line : lines) EXPECT_LE(line.size(), 60U) << line;
  for (const char c : text) EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~'));
}

TEST(Plots, PngAndPdfAreMadeAndOtherEndingsAreRefused) {
  const Recording r = plotted_recording();
  const recording::Plot p = unwrap(recording::plot(of(r, {"tau1"})));
  if (!program_on_path("gnuplot").empty()) {
    const std::string png = unwrap(recording::plot_file(p, "a.png"));
    EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
    EXPECT_EQ(unwrap(recording::plot_file(p, "a.pdf")).substr(0, 5), "%PDF-");
  }
  EXPECT_EQ(unwrap(recording::plot_file(p, "folder/a.svg")), recording::to_svg(p));
  const auto bad = recording::plot_file(p, "a.gif");
  ASSERT_FALSE(bad.ok());
  EXPECT_NE(bad.error().sentence().find(".svg, .png or .pdf"), std::string::npos);
}

}  // namespace
}  // namespace robomosp
