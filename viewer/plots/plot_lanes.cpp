// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/plots/plot_lanes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QContextMenuEvent>
#include <QElapsedTimer>
#include <QEvent>
#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QWheelEvent>

#include <qcustomplot.h>

#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kTickWidth = 46;    ///< of the numbers left of a lane [px of the design]
constexpr double kLeastHeight = 68;  ///< of a lane [px of the design]
constexpr double kMostLegend = 200;  ///< least height of a lane by its legend [px of the design]
constexpr double kRoom = 0.08;       ///< above and below the curves, of their range
constexpr double kDragAfter = 4;     ///< [px]

/// Labels with a true minus sign, three of a lane.
class LaneTicker : public QCPAxisTicker {
 public:
  LaneTicker() { setTickCount(3); }

 protected:
  QString getTickLabel(double tick, const QLocale&, QChar, int) override {
    QString s = QString::number(std::fabs(tick) < 1e-12 ? 0 : tick, 'g', 5);
    return s.replace('-', QChar(0x2212));
  }
};

/// Keys of the plots that the menus have, too, such as Home and Del: they are the plots' while
/// these have the focus.
class OwnKeys : public QObject {
 public:
  using QObject::QObject;
  bool eventFilter(QObject* watched, QEvent* event) override {
    if (event->type() != QEvent::ShortcutOverride) return QObject::eventFilter(watched, event);
    const auto* press = static_cast<QKeyEvent*>(event);
    const int key = press->key();
    const bool has_ctrl = press->modifiers().testFlag(Qt::ControlModifier);
    const bool is_up_or_down = key == Qt::Key_Up || key == Qt::Key_Down;
    const bool is_own =
        is_up_or_down ||
        (!has_ctrl && (key == Qt::Key_Plus || key == Qt::Key_Minus || key == Qt::Key_Left ||
                       key == Qt::Key_Right || key == Qt::Key_Home || key == Qt::Key_Delete));
    if (!is_own || press->modifiers().testFlag(Qt::AltModifier))
      return QObject::eventFilter(watched, event);
    event->accept();
    return true;
  }
};

QFont small_mono() {
  QFont font = theme().mono;
  font.setPixelSize(std::max(1, theme().px(10.5)));
  return font;
}

/// Columns of a legend. Widths of numbers change with their sign; the columns must not.
int legend_columns(const Lane& lane, int room) {
  if (lane.curves.size() <= 2) return 1;
  qsizetype longest = 0;
  for (const Curve& curve : lane.curves) {
    if (curve.base >= 0) return 1;  // with differences
    longest = std::max(longest, curve.name.size());
  }
  if (longest > 3) return 1;
  const int names = QFontMetrics(theme().small).horizontalAdvance('0') * static_cast<int>(longest);
  const int values = QFontMetrics(small_mono()).horizontalAdvance("−000.0");
  return theme().px(14) + names + values <= room / 2 ? 2 : 1;
}

int legend_rows(const Lane& lane, int room) {
  const int columns = legend_columns(lane, room);
  return (static_cast<int>(lane.curves.size()) + columns - 1) / columns;
}

QColor faded(QColor colour, double share) {
  colour.setAlphaF(static_cast<float>(share));
  return colour;
}

/// A dense curve is one thin stroke for each pixel, without dashes: smooth strokes of some thousand
/// points are slow, and look the same.
QPen pen_of(const Curve& curve, bool is_dimmed, bool is_dense) {
  QColor colour = theme().series[curve.colour % theme().series.size()];
  if (is_dimmed) colour = faded(colour, 0.4);
  const bool is_compared = curve.base >= 0;
  if (is_dense && is_compared) colour = faded(colour, 0.5 * colour.alphaF());
  QPen pen(colour, is_dense ? 0 : 1.3 * theme().zoom);
  pen.setCosmetic(true);
  if (is_compared && !is_dense) pen.setDashPattern({5, 3});
  return pen;
}

}  // namespace

QString fixed_number(double value, int decimals) {
  if (!std::isfinite(value)) return QStringLiteral("–");
  QString s = QString::number(value, 'f', std::clamp(decimals, 0, 12));
  if (s.toDouble() == 0) s.remove('-');
  return s.replace('-', QChar(0x2212));
}

int decimals_for(double greatest) {
  if (!(greatest > 0) || !std::isfinite(greatest)) return 2;
  return std::clamp(2 - static_cast<int>(std::floor(std::log10(greatest))), 0, 9);
}

PlotLanes::PlotLanes(TimeAxis& axis, QWidget* parent)
    : QWidget(parent), axis_(axis), plot_(new QCustomPlot(this)), themed_(theme_revision()) {
  setObjectName("plot_lanes");
  setAccessibleName("Plots");
  setToolTip(
      "Click: move the time; wheel: zoom; drag: move the zoomed range; double click: all.\n"
      "Up and Down choose a lane, Ctrl with them moves it, Del removes it; + and - zoom.\n"
      "recording.plot{id = ..., columns = ...}");
  setFocusPolicy(Qt::StrongFocus);
  installEventFilter(new OwnKeys(this));
  setMouseTracking(false);
  plot_->setObjectName("plot_canvas");
  plot_->setAccessibleName("Curves");
  plot_->setToolTip(toolTip());
  plot_->setAttribute(Qt::WA_TransparentForMouseEvents);
  plot_->setFocusPolicy(Qt::NoFocus);
  plot_->setInteractions({});
  plot_->setAutoAddPlottableToLegend(false);
  plot_->plotLayout()->clear();
  plot_->plotLayout()->setRowSpacing(0);
  plot_->setPlottingHints(QCP::phCacheLabels);
  draw_timer_.setSingleShot(true);
  draw_timer_.setInterval(0);
  connect(&draw_timer_, &QTimer::timeout, this, [this] { draw(); });
  axis_.changed.add(this, [this] {
    place();
    draw_later();
  });
  style();
}

PlotLanes::~PlotLanes() = default;

int PlotLanes::legend_width() const {
  return std::max(0, static_cast<int>(axis_.left()) - theme().px(kTickWidth));
}

QSize PlotLanes::sizeHint() const {
  const int lanes = std::max(1, static_cast<int>(lanes_.size()));
  return {theme().px(400), theme().px(90) * lanes};
}

QSize PlotLanes::minimumSizeHint() const {
  // A legend with differences is higher than its lane needs to be; beyond that the panel scrolls.
  const int room = legend_width() - 2 * theme().px(8);
  int each = theme().px(kLeastHeight);
  for (const Lane& lane : lanes_)
    each = std::max(each, theme().px(20) + legend_rows(lane, room) * theme().px(12));
  each = std::min(each, theme().px(kMostLegend));
  return {theme().px(160), each * static_cast<int>(lanes_.size())};
}

void PlotLanes::show_lanes(std::vector<Lane> lanes) {
  lanes_ = std::move(lanes);
  current_ = std::clamp(current_, 0, std::max(0, static_cast<int>(lanes_.size()) - 1));
  build();
  updateGeometry();
  update();
}

void PlotLanes::set_current_lane(int lane) {
  current_ = std::clamp(lane, 0, std::max(0, static_cast<int>(lanes_.size()) - 1));
  update();
}

void PlotLanes::refresh() {
  measure();
  draw_later();
}

void PlotLanes::build() {
  plot_->clearPlottables();
  plot_->plotLayout()->clear();
  drawn_.clear();
  for (const Lane& lane : lanes_) {
    Drawn d;
    d.rect = new QCPAxisRect(plot_, true);
    d.rect->setAutoMargins(QCP::msNone);
    plot_->plotLayout()->addElement(static_cast<int>(drawn_.size()), 0, d.rect);
    QCPAxis *x = d.rect->axis(QCPAxis::atBottom), *y = d.rect->axis(QCPAxis::atLeft);
    x->setTickLabels(false);
    x->setTicks(false);
    y->setTicker(QSharedPointer<QCPAxisTicker>(new LaneTicker));
    y->setSubTicks(false);
    y->setTickLength(0, 0);
    for (std::size_t i = 0; i < lane.curves.size(); ++i) {
      QCPGraph* graph = plot_->addGraph(x, y);
      if (lane.curves[i].is_step) graph->setLineStyle(QCPGraph::lsStepLeft);
      d.graphs.push_back(graph);
    }
    drawn_.push_back(std::move(d));
  }
  style();
  measure();
  place();
  draw_later();
}

void PlotLanes::style() {
  const Theme& t = theme();
  plot_->setBackground(QBrush(t.panel));
  for (std::size_t l = 0; l < drawn_.size(); ++l) {
    Drawn& d = drawn_[l];
    QCPAxis *x = d.rect->axis(QCPAxis::atBottom), *y = d.rect->axis(QCPAxis::atLeft);
    for (QCPAxis* axis : {x, y}) {
      axis->setBasePen(Qt::NoPen);
      axis->setTickPen(Qt::NoPen);
      axis->setSubTickPen(Qt::NoPen);
      axis->grid()->setPen(QPen(faded(t.line, 0.55), 1));
      axis->grid()->setZeroLinePen(QPen(t.line, 1));
      axis->grid()->setSubGridVisible(false);
    }
    y->setTickLabelFont(small_mono());
    y->setTickLabelColor(t.text_quiet);
    y->setTickLabelPadding(t.px(6));
    d.rect->setBackground(QBrush(t.panel));
  }
}

void PlotLanes::measure() {
  for (std::size_t l = 0; l < drawn_.size(); ++l) {
    double low = 0, high = 0;
    bool is_first = true;
    drawn_[l].decimals.clear();
    for (const Curve& curve : lanes_[l].curves) {
      const auto range = curve.series ? curve.series->extremes() : std::nullopt;
      double greatest = 0;
      if (range) {
        const double a = std::min(range->first * curve.scale, range->second * curve.scale),
                     b = std::max(range->first * curve.scale, range->second * curve.scale);
        low = is_first ? a : std::min(low, a);
        high = is_first ? b : std::max(high, b);
        is_first = false;
        greatest = std::max(std::fabs(a), std::fabs(b));
      }
      drawn_[l].decimals.push_back(decimals_for(greatest));
    }
    // Beside large values, the noise of a joint that rests needs no digits.
    if (lanes_[l].has_one_unit && !is_first) {
      const int most = decimals_for(std::max(std::fabs(low), std::fabs(high))) + 1;
      for (int& decimals : drawn_[l].decimals) decimals = std::min(decimals, most);
    }
    if (is_first) high = 1;
    if (high - low < 1e-12 * std::max(1.0, std::fabs(high))) {
      const double half = std::max(1e-9, 0.5 * std::fabs(high));
      low -= half;
      high += half;
    }
    const double room = kRoom * (high - low);
    drawn_[l].low = low - room;
    drawn_[l].high = high + room;
  }
}

void PlotLanes::place() {
  const int left = legend_width();
  plot_->setGeometry(left, 0, std::max(1, width() - left), std::max(1, height()));
  const int gap = theme().px(5);  // half a number of the axis
  for (Drawn& d : drawn_)
    d.rect->setMargins(
        QMargins(static_cast<int>(axis_.left()) - left, gap, static_cast<int>(axis_.right()), gap));
}

void PlotLanes::draw_later() {
  if (!draw_timer_.isActive()) draw_timer_.start();
}

void PlotLanes::draw() {
  QElapsedTimer clock;
  clock.start();
  drawn_points_ = 0;
  const double low = axis_.low(), high = axis_.high();
  const int pixels =
      std::max(1, static_cast<int>(std::lround(axis_.length() * devicePixelRatioF())));
  QSharedPointer<QCPAxisTickerFixed> ticker(new QCPAxisTickerFixed);
  ticker->setTickStep(high > low ? axis_.tick(theme().px(70)) : 1);
  ticker->setScaleStrategy(QCPAxisTickerFixed::ssNone);
  for (std::size_t l = 0; l < drawn_.size(); ++l) {
    Drawn& d = drawn_[l];
    QCPAxis *x = d.rect->axis(QCPAxis::atBottom), *y = d.rect->axis(QCPAxis::atLeft);
    x->setTicker(ticker);
    x->setRange(low, high > low ? high : low + 1);
    y->setRange(d.low, d.high);
    for (std::size_t i = 0; i < d.graphs.size(); ++i) {
      const Curve& curve = lanes_[l].curves[i];
      if (!curve.series || !(high > low)) {
        d.graphs[i]->data()->clear();
        continue;
      }
      Series::Line line = curve.series->line(low, high, pixels);
      QVector<QCPGraphData> points(static_cast<qsizetype>(line.x.size()));
      for (std::size_t k = 0; k < line.x.size(); ++k)
        points[static_cast<qsizetype>(k)] = {line.x[k], curve.scale * line.y[k]};
      drawn_points_ += line.x.size();
      const bool is_dense = line.x.size() > static_cast<std::size_t>(3 * pixels / 2);
      d.graphs[i]->setPen(pen_of(curve, is_dimmed_, is_dense));
      d.graphs[i]->setAntialiased(!is_dense);
      d.graphs[i]->data()->set(points, true);
    }
  }
  plot_->replot(QCustomPlot::rpQueuedRefresh);
  update();
  drawn_ms_ = static_cast<double>(clock.nsecsElapsed()) * 1e-6;
}

std::optional<double> PlotLanes::value(const Curve& curve, double time) const {
  if (!curve.series) return std::nullopt;
  const auto v = curve.is_step ? curve.series->step_at(time) : curve.series->at(time);
  return v ? std::optional(*v * curve.scale) : std::nullopt;
}

QString PlotLanes::value_text(std::size_t lane, std::size_t curve) const {
  if (!cursor_ || lane >= lanes_.size() || curve >= lanes_[lane].curves.size()) return {};
  const Curve& c = lanes_[lane].curves[curve];
  const int decimals = drawn_[lane].decimals[curve];
  const auto v = value(c, *cursor_);
  if (!v) return QStringLiteral("–");
  QString text = fixed_number(*v, decimals);
  if (c.base >= 0 && static_cast<std::size_t>(c.base) < lanes_[lane].curves.size())
    if (const auto base = value(lanes_[lane].curves[static_cast<std::size_t>(c.base)], *cursor_)) {
      const double difference = *v - *base;
      const QString sign = difference > 0 ? "+" : "";
      text += "  Δ " + sign + fixed_number(difference, decimals);
    }
  return text;
}

std::vector<PlotLanes::Mark> PlotLanes::marks(double time) const {
  std::vector<Mark> out;
  if (time < axis_.low() || time > axis_.high()) return out;
  const double x = axis_.x_of(time);
  for (std::size_t l = 0; l < drawn_.size(); ++l)
    for (const Curve& curve : lanes_[l].curves)
      if (const auto v = value(curve, time); v && curve.base < 0) {
        const QRect r = drawn_[l].rect->rect();
        const double share = (*v - drawn_[l].low) / (drawn_[l].high - drawn_[l].low);
        out.push_back({QPointF(x, plot_->y() + r.bottom() - share * r.height()),
                       theme().series[curve.colour % theme().series.size()]});
      }
  return out;
}

void PlotLanes::set_cursor(std::optional<double> time) {
  cursor_ = time;
  update(QRect(0, 0, legend_width(), height()));
}

void PlotLanes::set_dimmed(bool on) {
  if (std::exchange(is_dimmed_, on) == on) return;
  style();
  draw_later();
}

QRect PlotLanes::lane_rect(int lane) const {
  if (lanes_.empty()) return rect();
  const int n = static_cast<int>(lanes_.size());
  const int top = height() * lane / n, bottom = height() * (lane + 1) / n;
  return {0, top, width(), bottom - top};
}

int PlotLanes::lane_at(int y) const {
  const int n = static_cast<int>(lanes_.size());
  return n == 0 ? -1 : std::clamp(y * n / std::max(1, height()), 0, n - 1);
}

void PlotLanes::paint_legend(QPainter& p, std::size_t l, const QRect& area) const {
  const Theme& t = theme();
  const Lane& lane = lanes_[l];
  p.setClipRect(area);
  QFont bold = t.small;
  bold.setBold(true);
  p.setFont(bold);
  p.setPen(hasFocus() && static_cast<int>(l) == current_ ? t.accent : t.text);
  const int pad = t.px(8);
  p.drawText(area.adjusted(pad, t.px(3), -t.px(4), 0), Qt::AlignLeft | Qt::AlignTop,
             QFontMetrics(bold).elidedText(lane.title, Qt::ElideRight, area.width() - pad));
  const QFont mono = small_mono();
  const QFontMetrics name_size(t.small), value_size(mono);
  const int room = area.width() - 2 * pad, columns = legend_columns(lane, room);
  const int each = room / columns;
  // Rows of a low lane are closer, so that it shows all joints of an arm.
  const int rows = legend_rows(lane, room);
  const int row = std::clamp((area.height() - t.px(18)) / std::max(1, rows), t.px(12), t.px(14));
  for (std::size_t i = 0; i < lane.curves.size(); ++i) {
    const Curve& curve = lane.curves[i];
    const int column = static_cast<int>(i) % columns, line = static_cast<int>(i) / columns;
    const QRect r(area.left() + pad + column * each, area.top() + t.px(18) + line * row, each, row);
    if (r.top() > area.bottom()) break;
    const QColor colour = t.series[curve.colour % t.series.size()];
    const QRect bar(r.left(), r.top() + t.px(2), t.px(3), row - t.px(4));
    if (curve.base >= 0) {
      p.fillRect(QRect(bar.left(), bar.top(), bar.width(), bar.height() / 3), colour);
      p.fillRect(QRect(bar.left(), bar.bottom() - bar.height() / 3, bar.width(), bar.height() / 3),
                 colour);
    } else {
      p.fillRect(bar, colour);
    }
    const QString value = value_text(l, i);
    const int value_width = value_size.horizontalAdvance(value);
    p.setFont(t.small);
    p.setPen(t.text_dim);
    const QRect names = r.adjusted(t.px(8), 0, -value_width - t.px(10), 0);
    p.drawText(names, Qt::AlignLeft | Qt::AlignVCenter,
               name_size.elidedText(curve.name, Qt::ElideMiddle, names.width()));
    p.setFont(mono);
    p.setPen(t.text);
    p.drawText(r.adjusted(0, 0, -t.px(8), 0), Qt::AlignRight | Qt::AlignVCenter, value);
  }
  p.setClipping(false);
}

void PlotLanes::paintEvent(QPaintEvent* event) {
  const Theme& t = theme();
  QPainter p(this);
  p.fillRect(event->rect(), t.panel);
  const int left = legend_width();
  for (std::size_t l = 0; l < lanes_.size(); ++l) {
    const QRect r = lane_rect(static_cast<int>(l));
    paint_legend(p, l, QRect(0, r.top(), left, r.height()));
    p.setPen(t.line);
    p.drawLine(0, r.top(), left, r.top());
  }
  if (!hasFocus()) return;
  const QRect lane = lane_rect(current_);
  const QRectF ring(0, lane.top(), lanes_.empty() ? width() : left, lane.height());
  const double half = t.focus_ring / 2.0;
  p.setPen(QPen(t.accent, t.focus_ring));
  p.setBrush(Qt::NoBrush);
  p.drawRect(ring.adjusted(half, half, -half, -half));
}

void PlotLanes::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  place();
  draw_later();
}

void PlotLanes::wheelEvent(QWheelEvent* event) {
  // Over the legend the wheel scrolls the panel.
  if (event->position().x() < legend_width() || axis_.is_empty()) return event->ignore();
  const QPoint turn = event->angleDelta();
  if (event->modifiers().testFlag(Qt::ShiftModifier) || std::abs(turn.x()) > std::abs(turn.y()))
    axis_.pan(-(turn.x() + turn.y()) / 120.0 * 0.1 * (axis_.high() - axis_.low()));
  else axis_.zoom(std::pow(0.85, turn.y() / 120.0), axis_.time_at(event->position().x()));
  event->accept();
}

void PlotLanes::mousePressEvent(QMouseEvent* event) {
  current_ = std::max(0, lane_at(static_cast<int>(event->position().y())));
  update();
  if (event->button() != Qt::LeftButton || event->position().x() < legend_width()) return;
  pressed_ = event->position();
  pressed_low_ = axis_.low();
  pressed_high_ = axis_.high();
  is_dragging_ = false;
}

void PlotLanes::mouseMoveEvent(QMouseEvent* event) {
  if (!pressed_) return;
  const double moved = event->position().x() - pressed_->x();
  if (!is_dragging_ && std::fabs(moved) < kDragAfter) return;
  is_dragging_ = true;
  const double span = pressed_high_ - pressed_low_;
  if (axis_.is_zoomed()) {
    const double by = -moved / axis_.length() * span;
    axis_.show(pressed_low_ + by, pressed_high_ + by);
  } else if (on_scrub) {
    on_scrub(axis_.time_at(event->position().x()));
  }
}

void PlotLanes::mouseReleaseEvent(QMouseEvent* event) {
  if (pressed_ && !is_dragging_ && on_scrub) on_scrub(axis_.time_at(event->position().x()));
  pressed_.reset();
  is_dragging_ = false;
}

void PlotLanes::mouseDoubleClickEvent(QMouseEvent* event) {
  if (event->position().x() >= legend_width()) axis_.fit();
}

void PlotLanes::keyPressEvent(QKeyEvent* event) {
  const double span = axis_.high() - axis_.low(), middle = (axis_.high() + axis_.low()) / 2;
  const bool moves = event->modifiers().testFlag(Qt::ControlModifier);
  const int last = static_cast<int>(lanes_.size()) - 1;
  switch (event->key()) {
    case Qt::Key_Plus: axis_.zoom(0.8, cursor_.value_or(middle)); break;
    case Qt::Key_Minus: axis_.zoom(1.25, cursor_.value_or(middle)); break;
    case Qt::Key_Left: axis_.pan(-span / 10); break;
    case Qt::Key_Right: axis_.pan(span / 10); break;
    case Qt::Key_Home: axis_.fit(); break;
    case Qt::Key_Up:
    case Qt::Key_Down: {
      const int by = event->key() == Qt::Key_Up ? -1 : 1, to = current_ + by;
      if (to < 0 || to > last) break;
      if (moves && on_move) {
        const int from = current_;
        current_ = to;
        on_move(from, by);
      } else {
        current_ = to;
      }
      update();
      break;
    }
    case Qt::Key_Delete:
      if (last >= 0 && on_remove) on_remove(current_);
      break;
    default: QWidget::keyPressEvent(event); return;
  }
  event->accept();
}

void PlotLanes::contextMenuEvent(QContextMenuEvent* event) {
  if (lanes_.empty() || !on_menu) return;
  if (event->reason() == QContextMenuEvent::Mouse) current_ = lane_at(event->pos().y());
  const QPoint at = event->reason() == QContextMenuEvent::Mouse
                        ? event->globalPos()
                        : mapToGlobal(lane_rect(current_).topLeft());
  on_menu(current_, at);
}

void PlotLanes::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) {
    style();
    place();
    draw_later();
    updateGeometry();
  }
  QWidget::changeEvent(event);
}

}  // namespace robomosp::viewer
