// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/theme.h"

#include <QApplication>
#include <QPainter>
#include <QPainterPath>
#include <QPalette>
#include <QPixmap>
#include <QStyleFactory>

namespace robomosp::viewer {
namespace {

const QColor kInk(206, 210, 216), kDim(110, 114, 120), kAccent(74, 144, 240);

/// Paths are drawn in a square of 24 units.
void draw(Symbol symbol, QPainter& p) {
  QPainterPath path;
  switch (symbol) {
    case Symbol::play:
      path.addPolygon(QPolygonF({{7, 5}, {19, 12}, {7, 19}, {7, 5}}));
      p.fillPath(path, p.pen().color());
      return;
    case Symbol::pause:
      p.fillRect(QRectF(7, 5, 3.6, 14), p.pen().color());
      p.fillRect(QRectF(13.6, 5, 3.6, 14), p.pen().color());
      return;
    case Symbol::to_start:
      path.addPolygon(QPolygonF({{18, 5}, {8, 12}, {18, 19}, {18, 5}}));
      p.fillPath(path, p.pen().color());
      p.fillRect(QRectF(5, 5, 2.6, 14), p.pen().color());
      return;
    case Symbol::loop:
      p.drawArc(QRectF(5, 5, 14, 14), 50 * 16, 280 * 16);
      path.addPolygon(QPolygonF({{14.5, 3.5}, {20.5, 6.5}, {15, 10.5}, {14.5, 3.5}}));
      p.fillPath(path, p.pen().color());
      return;
    case Symbol::fit:
      for (const double x : {4.0, 20.0})
        for (const double y : {4.0, 20.0}) {
          const double dx = x < 12 ? 5 : -5, dy = y < 12 ? 5 : -5;
          p.drawPolyline(QPolygonF({{x + dx, y}, {x, y}, {x, y + dy}}));
        }
      p.drawRect(QRectF(9, 9, 6, 6));
      return;
    case Symbol::isometric:
      p.drawPolygon(QPolygonF({{12, 3}, {20, 7.5}, {20, 16.5}, {12, 21}, {4, 16.5}, {4, 7.5}}));
      p.drawPolyline(QPolygonF({{4, 7.5}, {12, 12}, {20, 7.5}}));
      p.drawLine(QPointF(12, 12), QPointF(12, 21));
      return;
    case Symbol::perspective:
      p.drawPolygon(QPolygonF({{3, 20}, {21, 20}, {15, 5}, {9, 5}}));
      p.drawLine(QPointF(6, 12.5), QPointF(18, 12.5));
      p.drawLine(QPointF(12, 5), QPointF(12, 20));
      return;
    case Symbol::picture:
      p.drawRoundedRect(QRectF(3, 6, 18, 13), 2, 2);
      p.drawEllipse(QPointF(12, 12.5), 3.6, 3.6);
      p.drawLine(QPointF(8, 6), QPointF(9.5, 4));
      p.drawLine(QPointF(9.5, 4), QPointF(14.5, 4));
      p.drawLine(QPointF(14.5, 4), QPointF(16, 6));
      return;
  }
}

}  // namespace

QIcon icon_of(Symbol symbol) {
  QIcon icon;
  for (const auto& [mode, colour] : {std::pair{QIcon::Normal, kInk}, {QIcon::Disabled, kDim}}) {
    for (const int size : {24, 48}) {
      QPixmap pixmap(size, size);
      pixmap.fill(Qt::transparent);
      QPainter painter(&pixmap);
      painter.setRenderHint(QPainter::Antialiasing);
      painter.scale(size / 24.0, size / 24.0);
      painter.setPen(QPen(colour, 1.7, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
      draw(symbol, painter);
      painter.end();
      icon.addPixmap(pixmap, mode);
    }
  }
  return icon;
}

void apply_dark_theme(QApplication& application) {
  application.setStyle(QStyleFactory::create("Fusion"));
  QPalette p;
  const QColor window(43, 45, 49), base(30, 31, 34), text(222, 225, 229);
  p.setColor(QPalette::Window, window);
  p.setColor(QPalette::WindowText, text);
  p.setColor(QPalette::Base, base);
  p.setColor(QPalette::AlternateBase, QColor(36, 38, 41));
  p.setColor(QPalette::ToolTipBase, base);
  p.setColor(QPalette::ToolTipText, text);
  p.setColor(QPalette::Text, text);
  p.setColor(QPalette::Button, QColor(53, 55, 60));
  p.setColor(QPalette::ButtonText, text);
  p.setColor(QPalette::BrightText, Qt::white);
  p.setColor(QPalette::Link, kAccent);
  p.setColor(QPalette::Highlight, QColor(48, 110, 220));
  p.setColor(QPalette::HighlightedText, Qt::white);
  p.setColor(QPalette::PlaceholderText, QColor(134, 138, 145));
  for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
    p.setColor(QPalette::Disabled, role, kDim);
  application.setPalette(p);
  application.setStyleSheet(
      "QToolTip { border: 1px solid #55585e; padding: 3px; }"
      "QMainWindow::separator { background: #232427; width: 3px; height: 3px; }"
      "QToolBar { border: 0; spacing: 3px; padding: 3px 6px; }"
      "QToolButton { border: 0; border-radius: 4px; padding: 4px; }"
      "QToolButton:hover { background: #45484e; }"
      "QToolButton:checked { background: #3a4d6b; }"
      "QStatusBar { background: #2b2d31; } QStatusBar::item { border: 0; }"
      "QHeaderView::section { background: #35373c; border: 0; padding: 3px 6px; }"
      "QTreeView { border: 0; }"
      "QSlider::groove:horizontal { height: 4px; border-radius: 2px; background: #1e1f22; }"
      "QSlider::sub-page:horizontal { height: 4px; border-radius: 2px; background: #4a90f0; }"
      "QSlider::sub-page:horizontal:disabled { background: #3a3c41; }"
      "QSlider::handle:horizontal { width: 14px; height: 14px; margin: -5px 0; border-radius: 7px;"
      " background: #d7dade; } QSlider::handle:horizontal:disabled { background: #55585e; }");
}

}  // namespace robomosp::viewer
