// SPDX-License-Identifier: Apache-2.0
#include "recording/plot/layout.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernel/text.h"

namespace robomosp::recording {
namespace {

/// Ten colours that stay apart for most kinds of colour vision (Tableau 10 order, own values).
constexpr std::array<const char*, 10> kPalette{"#2f6fb7", "#e07b1f", "#3a9a4b", "#c43c3c",
                                               "#7d5bb3", "#8a5a48", "#d264a8", "#6d7680",
                                               "#aaa623", "#22a3b8"};
constexpr const char* kGrid = "#e3e7ec";
constexpr const char* kFineGrid = "#f1f3f6";
constexpr const char* kAxis = "#9aa3ad";
constexpr const char* kBeyond = "#c43c3c";
// To be read at half the size as well.
constexpr double kTextSize = Canvas::kTextSize, kTitleSize = 17;
constexpr double kLetter = 0.61 * kTextSize;  ///< width of a letter, about and at most

std::string colour_of(std::size_t i) { return kPalette[i % kPalette.size()]; }

/// At most about two points a pixel. Along a rising x the lowest and highest of each run of samples
/// are kept; of other lines what is a third of a pixel from the point before.
PixelPath thinned(const PixelPath& points, double width) {
  const std::size_t budget = static_cast<std::size_t>(width) * 2;
  if (points.size() <= budget) return points;
  PixelPath out;
  const std::size_t n = points.size();
  const bool rises = std::is_sorted(points.begin(), points.end(),
                                    [](const auto& a, const auto& b) { return a[0] < b[0]; });
  if (!rises) {
    for (const auto& p : points)
      if (out.empty() || std::hypot(p[0] - out.back()[0], p[1] - out.back()[1]) > 0.3)
        out.push_back(p);
    return out;
  }
  for (std::size_t r = 0; r < budget / 2; ++r) {
    const std::size_t a = r * n / (budget / 2), b = (r + 1) * n / (budget / 2);
    const auto [low, high] =
        std::minmax_element(points.begin() + static_cast<std::ptrdiff_t>(a),
                            points.begin() + static_cast<std::ptrdiff_t>(b),
                            [](const auto& p, const auto& q) { return p[1] < q[1]; });
    out.push_back(*std::min(low, high));
    if (low != high) out.push_back(*std::max(low, high));
  }
  out.push_back(points.back());
  return out;
}

/// The pieces of a line between its gaps.
template <class ToPixel>
void draw_line(Canvas& canvas, std::size_t count, double width, const Stroke& stroke,
               ToPixel&& pixel) {
  PixelPath piece;
  for (std::size_t i = 0; i <= count; ++i) {
    std::array<double, 2> p{NAN, NAN};
    if (i < count) p = pixel(i);
    if (std::isfinite(p[0]) && std::isfinite(p[1])) {
      piece.push_back(p);
      continue;
    }
    if (piece.size() == 1) piece.push_back(piece.front());  // a lone sample is a dot
    if (!piece.empty()) canvas.line(thinned(piece, width), stroke);
    piece.clear();
  }
}

/// Below the title: how the lines of each recording look, in as many rows as that takes. Gives the
/// height of the rows.
double draw_sources(Canvas& canvas, const Plot& plot, double left, double y, bool coloured) {
  constexpr double kRow = 22;
  const double right = plot.width - 16.0;
  double x = left, height = 24;
  for (std::size_t s = 0; s < plot.sources.size(); ++s) {
    const double wide = 40 + kLetter * static_cast<double>(plot.sources[s].size());
    if (x > left && x + wide > right) x = left, y += kRow, height += kRow;
    const std::string colour = coloured ? colour_of(s) : "#39424d";
    canvas.line({{x, y}, {x + 34, y}}, {colour, 2, coloured ? 0 : s, 1});
    canvas.text(x + 40, y, plot.sources[s]);
    x += wide + 24;
  }
  return height;
}

/// One column a panel: then colours tell the recordings apart, else dashes do.
bool is_by_source(const Plot& plot) {
  return !plot.sources.empty() &&
         std::all_of(plot.panels.begin(), plot.panels.end(), [](const PlotPanel& panel) {
           return std::count_if(panel.lines.begin(), panel.lines.end(),
                                [](const PlotLine& line) { return line.source == 0; }) <= 1;
         });
}

class Flat {
 public:
  Flat(const Plot& plot, Canvas& canvas)
      : plot_(plot), canvas_(canvas), by_source_(is_by_source(plot)) {
    if (!plot.sources.empty()) top_ += draw_sources(canvas_, plot, left_, 48, by_source_);
    const double gaps = kGap * static_cast<double>(plot.panels.size() - 1);
    inner_ = (plot.height - top_ - kBottom - gaps) / static_cast<double>(plot.panels.size());
    right_ =
        plot.width - (by_source_ || names_itself() ? 28.0 : 54 + std::max(74.0, widest_name()));
    left_ = std::max(left_, 46 + widest_number());
  }

  void draw() {
    canvas_.text((left_ + right_) / 2, 22, plot_.title, Anchor::middle, kTitleSize);
    x_ = x_range(plot_);
    for (std::size_t p = 0; p < plot_.panels.size(); ++p) panel(p);
    canvas_.text((left_ + right_) / 2, plot_.height - 16.0, plot_.x_label, Anchor::middle);
  }

 private:
  [[nodiscard]] double px(double x) const {
    return left_ + (x - x_.low) / (x_.high - x_.low) * (right_ - left_);
  }

  /// One scale along both axes: the axis with room to spare is made longer.
  void level(ValueRange& y) {
    const double x_scale = (right_ - left_) / (x_.high - x_.low),
                 y_scale = inner_ / (y.high - y.low);
    ValueRange& longer = x_scale > y_scale ? x_ : y;
    const double span = x_scale > y_scale ? (right_ - left_) / y_scale : inner_ / x_scale;
    const double middle = (longer.low + longer.high) / 2;
    longer = {middle - span / 2, middle + span / 2};
  }

  [[nodiscard]] int marks() const { return std::clamp(static_cast<int>(inner_ / 40), 3, 6); }

  [[nodiscard]] double widest_name() const {
    std::size_t letters = 0;
    for (const PlotPanel& panel : plot_.panels)
      for (const PlotLine& line : panel.lines) letters = std::max(letters, line.name.size());
    // Of names without end some letters may be cut off.
    return std::min(kLetter * static_cast<double>(letters), 0.3 * plot_.width);
  }

  /// One line a panel, and its whole name beside the axis: that needs no legend.
  [[nodiscard]] bool names_itself() const {
    return plot_.sources.empty() &&
           std::all_of(plot_.panels.begin(), plot_.panels.end(), [&](const PlotPanel& panel) {
             return panel.lines.size() == 1 &&
                    panel.y_label.starts_with(panel.lines.front().name) &&
                    kLetter * static_cast<double>(panel.y_label.size()) < inner_ + kGap;
           });
  }

  /// Of the numbers beside the panels.
  [[nodiscard]] double widest_number() const {
    std::size_t letters = 0;
    for (const PlotPanel& panel : plot_.panels) {
      const ValueRange range = y_range(panel, marks(), plot_.log_y);
      for (const AxisMark& mark : axis_marks(range, marks(), plot_.log_y))
        letters = std::max(letters, mark.text.size());
    }
    return kLetter * static_cast<double>(letters);
  }

  void panel(std::size_t p) {
    const PlotPanel& panel = plot_.panels[p];
    const double y0 = top_ + static_cast<double>(p) * (inner_ + kGap), y1 = y0 + inner_;
    ValueRange range = y_range(panel, marks(), plot_.log_y);
    if (plot_.is_metric) level(range);
    const auto py = [&](double y) {
      return y1 - (y - range.low) / (range.high - range.low) * inner_;
    };
    band(panel.upper, range.high, panel.upper < range.high, py);
    band(panel.lower, range.low, panel.lower > range.low, py);
    if (plot_.log_y && inner_ / (range.high - range.low) >= kFineDecade)
      for (const double y : fine_marks(range))
        canvas_.line({{left_, py(y)}, {right_, py(y)}}, {kFineGrid});
    if (plot_.log_x && (right_ - left_) / (x_.high - x_.low) >= kFineDecade)
      for (const double x : fine_marks(x_)) canvas_.line({{px(x), y0}, {px(x), y1}}, {kFineGrid});
    for (const AxisMark& y : axis_marks(range, marks(), plot_.log_y)) {
      canvas_.line({{left_, py(y.at)}, {right_, py(y.at)}}, {kGrid});
      canvas_.text(left_ - 8, py(y.at), y.text, Anchor::end);
    }
    for (const AxisMark& x : axis_marks(x_, 8, plot_.log_x)) {
      canvas_.line({{px(x.at), y0}, {px(x.at), y1}}, {kGrid});
      if (p + 1 == plot_.panels.size()) canvas_.text(px(x.at), y1 + 16, x.text, Anchor::middle);
    }
    // Words of marks that are near each other stand below each other, and below a limit at the top.
    double taken = -1e9, lower = 0;
    const bool has_limit = panel.upper >= range.low && panel.upper <= range.high;
    const double under = has_limit ? py(panel.upper) - y0 : kTextSize;
    const double top = y0 + (under < kTextSize ? under + kTextSize - 2 : 8);
    for (const PlotMark& mark : plot_.marks) {
      const double x0 = std::clamp(px(mark.from), left_, right_),
                   x1 = std::clamp(px(mark.to), left_, right_);
      canvas_.area({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, mark.colour, 0.16);
      canvas_.line({{x0, y0}, {x0, y1}}, {mark.colour, 1.2, 1, 1});
      if (p != 0 || mark.text.empty()) continue;
      lower = x0 < taken ? lower + kTextSize : 0;
      if (lower > inner_ - 2 * kTextSize) lower = 0;
      const double width = kLetter * static_cast<double>(mark.text.size());
      if (x0 + 3 + width > right_)  // where the legend begins
        canvas_.text(x0 - 3, top + lower, mark.text, Anchor::end);
      else canvas_.text(x0 + 3, top + lower, mark.text);
      taken = x0 + 3 + width;
    }
    for (const double limit : {panel.lower, panel.upper})
      if (limit >= range.low && limit <= range.high)
        canvas_.line({{left_, py(limit)}, {right_, py(limit)}}, {kBeyond, 1, 1, 1});
    canvas_.line({{left_, y0}, {left_, y1}}, {kAxis});
    canvas_.line({{left_, y1}, {right_, y1}}, {kAxis});
    canvas_.text(18, (y0 + y1) / 2, panel.y_label, Anchor::middle, kTextSize, true);
    for (const PlotLine& line : panel.lines)
      draw_line(canvas_, std::min(line.x.size(), line.y.size()), plot_.width,
                by_source_
                    ? Stroke{colour_of(line.source), 1.8, 0, 1}
                    : Stroke{colour_of(line.colour), line.source ? 1.6 : 2.0, dash_of(line), 1},
                [&](std::size_t i) {
                  return std::array{px(line.x[i]), py(line.y[i])};
                });
    if (!by_source_ && !names_itself()) legend(panel, y0);
  }

  template <class Py>
  void band(double from, double to, bool is_seen, Py&& py) {
    if (!is_seen) return;
    canvas_.area({{left_, py(from)}, {right_, py(from)}, {right_, py(to)}, {left_, py(to)}},
                 kBeyond, 0.1);
  }

  /// Dashes tell recordings apart, or of one recording the columns that share a colour.
  [[nodiscard]] std::size_t dash_of(const PlotLine& line) const {
    return plot_.sources.empty() ? line.colour / kPalette.size() : line.source;
  }

  void legend(const PlotPanel& panel, double y0) {
    std::size_t count = 0;
    for (const PlotLine& line : panel.lines) count += line.source == 0;
    const double step =
        std::min(21.0, std::max(kTextSize, (inner_ - 8) / static_cast<double>(count)));
    double y = y0 + 8;
    for (const PlotLine& line : panel.lines) {
      if (line.source != 0) continue;
      canvas_.line({{right_ + 14, y}, {right_ + 34, y}},
                   {colour_of(line.colour), 2.5, dash_of(line), 1});
      canvas_.text(right_ + 40, y, line.name);
      y += step;
    }
  }

  static constexpr double kBottom = 56, kGap = 26;
  static constexpr double kFineDecade = 36;  ///< that long a decade shows its lines between [px]
  const Plot& plot_;
  Canvas& canvas_;
  const bool by_source_;
  double top_ = 46, left_ = 76, right_ = 0, inner_ = 0;
  ValueRange x_;
};

/// A box seen from the front right and above in parallel, with the path and its shadows on the
/// floor and on the two far walls. All axes have one scale.
class Space {
 public:
  Space(const Plot& plot, Canvas& canvas) : plot_(plot), canvas_(canvas) {
    const PlotPanel& panel = plot.panels.front();
    std::array<ValueRange, 3> data;
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      Extent e;
      for (const PlotLine& line : panel.lines) e.add(values(line, k));
      data[k] = e.range();
      if (!e.is_single()) longest = std::max(longest, data[k].high - data[k].low);
    }
    if (!(longest > 0)) longest = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      // A path within a plane still gets a box.
      const double middle = (data[k].low + data[k].high) / 2;
      const double span = std::clamp(data[k].high - data[k].low, 0.3 * longest, longest);
      const AxisRange r = nice_range(middle - span / 2, middle + span / 2, 5);
      box_[k] = {r.low, r.high};
    }
    place();
  }

  void draw() {
    canvas_.text(plot_.width / 2.0, 22, plot_.title, Anchor::middle, kTitleSize);
    if (!plot_.sources.empty()) draw_sources(canvas_, plot_, 76, 48, true);
    for (std::size_t k = 0; k < 3; ++k) grid(k);
    for (std::size_t k = 0; k < 3; ++k) shadows(k);
    for (const PlotLine& line : plot_.panels.front().lines) {
      draw_line(canvas_, line.z.size(), plot_.width, {colour_of(line.colour), 2.2},
                [&](std::size_t i) {
                  return pixel({line.x[i], line.y[i], line.z[i]});
                });
      start(line);
    }
  }

 private:
  using Point = std::array<double, 3>;

  static const std::vector<double>& values(const PlotLine& line, std::size_t k) {
    return k == 0 ? line.x : k == 1 ? line.y : line.z;
  }

  /// Seen from azimuth -60 and elevation 25 degrees: right and up, without scale.
  static std::array<double, 2> seen(const Point& p) {
    constexpr double kCa = 0.5, kSa = -0.8660254037844386;
    constexpr double kCe = 0.9063077870366499, kSe = 0.42261826174069944;
    return {-kSa * p[0] + kCa * p[1], p[2] * kCe - (kCa * p[0] + kSa * p[1]) * kSe};
  }
  [[nodiscard]] std::array<double, 2> pixel(const Point& p) const {
    const auto s = seen(p);
    return {x0_ + scale_ * s[0], y0_ - scale_ * s[1]};
  }

  /// Scale and place such that the box fills the picture between title and lower edge.
  void place() {
    std::array<double, 2> low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
    for (unsigned corner = 0; corner < 8; ++corner) {
      Point p{};
      for (std::size_t k = 0; k < 3; ++k) p[k] = corner >> k & 1U ? box_[k].high : box_[k].low;
      const auto s = seen(p);
      for (std::size_t k = 0; k < 2; ++k)
        low[k] = std::min(low[k], s[k]), high[k] = std::max(high[k], s[k]);
    }
    const double top = plot_.sources.empty() ? 48 : 70, left = 90, right = 50, bottom = 56;
    const double width = plot_.width - left - right, height = plot_.height - top - bottom;
    scale_ = std::min(width / (high[0] - low[0]), height / (high[1] - low[1]));
    x0_ = left + width / 2 - scale_ * (low[0] + high[0]) / 2;
    y0_ = top + height / 2 + scale_ * (low[1] + high[1]) / 2;
  }

  /// The floor and the walls at the least x and the greatest y, which the path stands before.
  [[nodiscard]] double far(std::size_t k) const { return k == 1 ? box_[1].high : box_[k].low; }

  void grid(std::size_t k) {
    const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
    // As many marks as numbers fit beside the edge.
    Point low{}, high{};
    high[k] = box_[k].high - box_[k].low;
    const auto from = pixel(low), to = pixel(high);
    const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
    const auto marks =
        ticks_within(box_[k].low, box_[k].high, std::clamp(static_cast<int>(length / 45), 2, 5));
    const auto edge = [&](double at, std::size_t along, std::size_t fixed) {
      Point p{}, q{};
      p[k] = q[k] = at;
      p[fixed] = q[fixed] = far(fixed);
      p[along] = box_[along].low;
      q[along] = box_[along].high;
      canvas_.line({pixel(p), pixel(q)}, {kGrid});
    };
    for (const double m : marks) edge(m, a, b), edge(m, b, a);
    // Numbers along the near edge of the floor; those of z at the left.
    Point p{box_[0].low, box_[1].low, box_[2].low};
    if (k == 1) p[0] = box_[0].high;
    Point end = p;
    end[k] = box_[k].high;
    canvas_.line({pixel(p), pixel(end)}, {kAxis});
    const double dx = k == 0 ? -4 : k == 1 ? 8 : -8, dy = k == 2 ? 0 : 14;
    const Anchor anchor = k == 1 ? Anchor::start : Anchor::end;
    const double step = step_of(marks);
    for (const double m : marks) {
      p[k] = m;
      const auto at = pixel(p);
      canvas_.text(at[0] + dx, at[1] + (k == 1 ? 8 : dy), tick_text(m, step), anchor);
    }
    p[k] = (box_[k].low + box_[k].high) / 2;
    const auto at = pixel(p);
    const std::string& label = k == 0   ? plot_.x_label
                               : k == 1 ? plot_.panels.front().y_label
                                        : plot_.z_label;
    if (k == 2) canvas_.text(at[0] - 58, at[1], label, Anchor::middle, kTextSize, true);
    else
      canvas_.text(at[0] + (k == 0 ? -30 : 52), at[1] + 36, label,
                   k == 0 ? Anchor::end : Anchor::start);
  }

  void shadows(std::size_t k) {
    for (const PlotLine& line : plot_.panels.front().lines)
      draw_line(canvas_, line.z.size(), plot_.width, {colour_of(line.colour), 1.3, 0, 0.4},
                [&](std::size_t i) {
                  Point p{line.x[i], line.y[i], line.z[i]};
                  p[k] = far(k);
                  return pixel(p);
                });
  }

  /// A dot where the path starts.
  void start(const PlotLine& line) {
    if (line.z.empty()) return;
    const auto at = pixel({line.x[0], line.y[0], line.z[0]});
    if (!std::isfinite(at[0]) || !std::isfinite(at[1])) return;
    PixelPath ring;
    for (int i = 0; i < 24; ++i)
      ring.push_back(
          {at[0] + 4.5 * std::cos(i * M_PI / 12), at[1] + 4.5 * std::sin(i * M_PI / 12)});
    canvas_.area(std::move(ring), colour_of(line.colour), 1);
  }

  const Plot& plot_;
  Canvas& canvas_;
  std::array<ValueRange, 3> box_;
  double scale_ = 1, x0_ = 0, y0_ = 0;
};

}  // namespace

double step_of(const std::vector<double>& marks) {
  return marks.size() > 1 ? marks[1] - marks[0] : 1;
}

namespace {

/// 10^k, also where doubles end: "1000", "1e-09".
std::string power_text(double k) {
  const double power = std::pow(10, k);
  if (std::isfinite(power) && power > 0) return text::print_rounded(power, 6);
  return "1e" + text::print_rounded(k, 6);
}

/// Limits of a logarithmic axis, of logarithms: whole decades, round numbers within less than one.
ValueRange log_range(ValueRange r, int wanted) {
  const ValueRange decades{std::floor(r.low + 1e-9), std::ceil(r.high - 1e-9)};
  if (r.high - r.low < 1) {
    const AxisRange nice = nice_range(std::pow(10, r.low), std::pow(10, r.high), wanted);
    if (nice.low > 0 && std::isfinite(nice.high) && std::log10(nice.high) > std::log10(nice.low))
      return {std::log10(nice.low), std::log10(nice.high)};
  }
  return decades.high > decades.low ? decades : ValueRange{decades.low, decades.low + 1};
}

}  // namespace

std::vector<AxisMark> axis_marks(const ValueRange& range, int wanted, bool is_log) {
  std::vector<AxisMark> out;
  if (!is_log) {
    const auto marks = ticks_within(range.low, range.high, wanted);
    for (const double m : marks) out.push_back({m, tick_text(m, step_of(marks))});
    return out;
  }
  const double first = std::ceil(range.low - 1e-9), last = std::floor(range.high + 1e-9);
  const double count = last - first + 1;
  const double step = std::max(1.0, std::ceil((count - 1) / std::max(1, wanted)));
  for (double k = first; k <= last; k += step) out.push_back({k, power_text(k)});
  if (count > 0.5 * wanted) return out;
  // Few decades: 2 and 5 of each, too.
  for (double k = first - 1; k <= last; ++k)
    for (const double m : {2.0, 5.0}) {
      const double at = k + std::log10(m), value = m * std::pow(10, k);
      if (at >= range.low - 1e-9 && at <= range.high + 1e-9 && std::isfinite(value) && value > 0)
        out.push_back({at, text::print_rounded(value, 6)});
    }
  if (out.size() < 3 && range.high - range.low < 1) {
    const auto marks = ticks_within(std::pow(10, range.low), std::pow(10, range.high), wanted);
    if (marks.size() > out.size() && marks.front() > 0) {
      out.clear();
      for (const double m : marks) out.push_back({std::log10(m), tick_text(m, step_of(marks))});
    }
  }
  std::sort(out.begin(), out.end(),
            [](const AxisMark& a, const AxisMark& b) { return a.at < b.at; });
  return out;
}

std::vector<double> fine_marks(const ValueRange& range) {
  std::vector<double> out;
  for (double k = std::floor(range.low); k <= range.high; ++k)
    for (int m = 2; m < 10; ++m)
      if (const double at = k + std::log10(m); at > range.low && at < range.high) out.push_back(at);
  return out;
}

void Extent::add(double v) {
  if (!std::isfinite(v)) return;
  low_ = has_value_ ? std::min(low_, v) : v;
  high_ = has_value_ ? std::max(high_, v) : v;
  has_value_ = true;
}

void Extent::add(const std::vector<double>& values) {
  for (const double v : values) add(v);
}

bool Extent::is_single() const {
  return high_ - low_ <= 1e-9 * std::max(std::fabs(low_), std::fabs(high_));
}

ValueRange Extent::range() const {
  if (!has_value_) return {};
  if (!is_single()) return {low_, high_};
  const double size = std::max(std::fabs(low_), std::fabs(high_));
  const double room = size > 0 ? 0.05 * size : 0.5;
  return {low_ - room, high_ + room};
}

ValueRange x_range(const Plot& plot) {
  Extent e;
  for (const PlotPanel& panel : plot.panels)
    for (const PlotLine& line : panel.lines) e.add(line.x);
  if (plot.is_tight) return e.range();
  if (plot.log_x) return log_range(e.range(), 8);
  const AxisRange r = nice_range(e.range().low, e.range().high, 8);
  return {r.low, r.high};
}

ValueRange y_range(const PlotPanel& panel, int marks, bool is_log) {
  Extent e;
  for (const PlotLine& line : panel.lines) e.add(line.y);
  // Room beyond limits, so that their band is seen.
  const bool bounded = std::isfinite(panel.lower) && std::isfinite(panel.upper);
  const double beyond = bounded ? 0.06 * (panel.upper - panel.lower) : 0;
  e.add(panel.lower - beyond);
  e.add(panel.upper + beyond);
  if (bounded) return e.range();
  if (is_log) return log_range(e.range(), marks);
  const AxisRange r = nice_range(e.range().low, e.range().high, marks);
  return {r.low, r.high};
}

Canvas drawn(const Plot& plot) {
  Canvas canvas(plot.width, plot.height);
  if (plot.is_path) Space(plot, canvas).draw();
  else Flat(plot, canvas).draw();
  return canvas;
}

}  // namespace robomosp::recording
