// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/console_output.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <utility>

#include <QApplication>
#include <QClipboard>
#include <QContextMenuEvent>
#include <QCoreApplication>
#include <QHelpEvent>
#include <QKeyEvent>
#include <QMenu>
#include <QMimeData>
#include <QMouseEvent>
#include <QPainter>
#include <QScrollBar>
#include <QTextCursor>
#include <QTextDocument>
#include <QTextLayout>
#include <QToolTip>

#include "kernel/executor.h"
#include "viewer/desktop/lua_highlighter.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr QSize kMostPicture(340, 220);  ///< [px of the design]
constexpr double kLeastPicture = 90;     ///< height that low panels show [px of the design]

}  // namespace

/// The block of a picture has its title, and empty lines for the picture.
class ConsoleOutput::Picture : public QTextBlockUserData {
 public:
  Picture(std::uint64_t number_of_it, Source from)
      : number(number_of_it), source(std::move(from)) {}
  std::uint64_t number;
  Source source;
  QImage image;  ///< null until it is drawn
};

/// What is being drawn. Tasks keep it.
struct ConsoleOutput::Drawing {
  std::mutex mutex;
  std::condition_variable none;
  int tasks = 0;                   ///< guarded by mutex
  ConsoleOutput* owner = nullptr;  ///< of the GUI thread; null once it is gone
  int waiting = 0;                 ///< of the GUI thread: pictures that have not arrived
};

ConsoleOutput::ConsoleOutput(QWidget* parent)
    : QPlainTextEdit(parent), drawing_(std::make_shared<Drawing>()) {
  drawing_->owner = this;
  setReadOnly(true);
  setMouseTracking(true);
  viewport()->setMouseTracking(true);
}

ConsoleOutput::~ConsoleOutput() {
  drawing_->owner = nullptr;
  std::unique_lock lock(drawing_->mutex);
  drawing_->none.wait(lock, [this] { return drawing_->tasks == 0; });
}

QSize ConsoleOutput::most_pixels() const {
  // All of it is visible with its title, unless the panel is very low.
  const int free = viewport()->height() - 3 * QFontMetrics(font()).lineSpacing();
  const int height = std::clamp(free, theme().px(kLeastPicture), theme().px(kMostPicture.height()));
  return QSize(theme().px(kMostPicture.width()), height) * devicePixelRatioF();
}

bool ConsoleOutput::is_drawing() const { return drawing_->waiting > 0; }

std::uint64_t ConsoleOutput::add_picture(Source source) {
  const std::uint64_t number = next_++;
  QScrollBar* bar = verticalScrollBar();
  const bool is_at_end = bar->value() >= bar->maximum() - 4;
  QTextCursor cursor(document());
  cursor.movePosition(QTextCursor::End);
  if (!document()->isEmpty()) cursor.insertBlock();
  cursor.insertText(source.title.left(200).simplified());
  QTextBlock block = cursor.block();
  block.setUserState(static_cast<int>(ConsoleLine::note));
  block.setUserData(new Picture(number, std::move(source)));
  drop_oldest();
  if (is_at_end) bar->setValue(bar->maximum());
  return number;
}

void ConsoleOutput::draw(std::uint64_t number, std::function<QImage()> make) {
  ++drawing_->waiting;
  {
    const std::lock_guard lock(drawing_->mutex);
    ++drawing_->tasks;
  }
  Executor::of_process().run([state = drawing_, number, make = std::move(make)]() mutable {
    QImage image = make();
    make = {};
    QMetaObject::invokeMethod(
        QCoreApplication::instance(),
        [state, number, image = std::move(image)] {
          --state->waiting;
          if (state->owner) state->owner->take(number, image);
        },
        Qt::QueuedConnection);
    // The output waits for this, so that the application is there while its events are posted.
    const std::lock_guard lock(state->mutex);
    if (--state->tasks == 0) state->none.notify_all();
  });
}

void ConsoleOutput::take(std::uint64_t number, const QImage& image) {
  if (image.isNull()) return give_up(number, "cannot be shown as a picture");
  const QTextBlock block = block_of(number);
  Picture* picture = picture_of_block(block);
  if (!picture) return;  // cleared meanwhile
  const QSize most = most_pixels();
  picture->image = image.width() > most.width() || image.height() > most.height()
                       ? image.scaled(most, Qt::KeepAspectRatio, Qt::SmoothTransformation)
                       : image;
  picture->image.setDevicePixelRatio(devicePixelRatioF());
  QScrollBar* bar = verticalScrollBar();
  const bool is_at_end = bar->value() >= bar->maximum() - 4;
  reserve(block);
  if (is_at_end) bar->setValue(bar->maximum());
  viewport()->update();
}

void ConsoleOutput::give_up(std::uint64_t number, const QString& why) {
  QTextBlock block = block_of(number);
  if (!picture_of_block(block)) return;
  block.setUserData(nullptr);
  QTextCursor cursor(block);
  cursor.movePosition(QTextCursor::EndOfBlock);
  cursor.insertText(": " + why);
}

void ConsoleOutput::remove(std::uint64_t number) {
  const QTextBlock block = block_of(number);
  if (!block.isValid()) return;
  QTextCursor cursor(block);
  cursor.movePosition(QTextCursor::EndOfBlock, QTextCursor::KeepAnchor);
  cursor.removeSelectedText();
  if (block.previous().isValid()) cursor.deletePreviousChar();
}

ConsoleOutput::Picture* ConsoleOutput::picture_of_block(const QTextBlock& block) {
  return block.isValid() ? static_cast<Picture*>(block.userData()) : nullptr;
}

QTextBlock ConsoleOutput::block_of(std::uint64_t number) const {
  for (QTextBlock b = document()->lastBlock(); b.isValid(); b = b.previous())
    if (const Picture* p = picture_of_block(b); p && p->number == number) return b;
  return {};
}

void ConsoleOutput::reserve(const QTextBlock& block) {
  const Picture* picture = picture_of_block(block);
  if (!picture) return;
  QTextCursor cursor(block);
  const qsizetype title = block.text().indexOf(QChar::LineSeparator);
  if (title >= 0) {
    cursor.setPosition(block.position() + static_cast<int>(title));
    cursor.movePosition(QTextCursor::EndOfBlock, QTextCursor::KeepAnchor);
    cursor.removeSelectedText();
  }
  if (picture->image.isNull()) return;
  const double height = picture->image.deviceIndependentSize().height() + theme().gap;
  const double line = std::max(1, QFontMetrics(font()).lineSpacing());
  cursor.setPosition(block.position());
  cursor.movePosition(QTextCursor::EndOfBlock);
  cursor.insertText(
      QString(static_cast<int>(std::ceil(height / line)), QChar(QChar::LineSeparator)));
}

void ConsoleOutput::refit() {
  for (QTextBlock b = document()->firstBlock(); b.isValid(); b = b.next())
    if (picture_of_block(b)) reserve(b);
}

void ConsoleOutput::drop_oldest() {
  std::size_t count = 0, bytes = 0;
  for (QTextBlock b = document()->lastBlock(); b.isValid(); b = b.previous()) {
    Picture* p = picture_of_block(b);
    if (!p) continue;
    ++count;
    bytes += p->source.bytes;
    if (count <= kMostPictures && bytes <= kMostBytes) continue;
    p->image = {};
    reserve(b);
    b.setUserData(nullptr);
    QTextCursor cursor(b);
    cursor.movePosition(QTextCursor::EndOfBlock);
    cursor.insertText(" (no longer shown)");
  }
}

std::size_t ConsoleOutput::pictures() const {
  std::size_t count = 0;
  for (QTextBlock b = document()->firstBlock(); b.isValid(); b = b.next())
    if (const Picture* p = picture_of_block(b)) count += !p->image.isNull();
  return count;
}

QRect ConsoleOutput::place_of(const QTextBlock& block) const {
  const Picture* picture = picture_of_block(block);
  if (!picture || picture->image.isNull() || !block.isVisible()) return {};
  const qsizetype title = block.text().indexOf(QChar::LineSeparator);
  if (title < 0) return {};
  const QTextLine line = block.layout()->lineForTextPosition(static_cast<int>(title) + 1);
  if (!line.isValid()) return {};
  const QRectF around = blockBoundingGeometry(block).translated(contentOffset());
  QSizeF size = picture->image.deviceIndependentSize();
  const double margin = document()->documentMargin();
  const double free = std::max(16.0, viewport()->width() - 2 * margin);
  if (size.width() > free) size *= free / size.width();
  return QRectF(QPointF(margin, around.top() + line.y()), size).toRect();
}

QRect ConsoleOutput::last_picture_place() const {
  for (QTextBlock b = document()->lastBlock(); b.isValid(); b = b.previous())
    if (picture_of_block(b)) return place_of(b) & viewport()->rect();
  return {};
}

QTextBlock ConsoleOutput::picture_at(const QPoint& at) const {
  for (QTextBlock b = firstVisibleBlock(); b.isValid(); b = b.next()) {
    if (blockBoundingGeometry(b).translated(contentOffset()).top() > viewport()->height()) break;
    if (place_of(b).contains(at)) return b;
  }
  return {};
}

void ConsoleOutput::open(const QTextBlock& block) {
  if (const Picture* p = picture_of_block(block); p && on_open) {
    const Source source = p->source;
    on_open(source.title, source.result);
  }
}

void ConsoleOutput::paintEvent(QPaintEvent* event) {
  QPlainTextEdit::paintEvent(event);
  QPainter painter(viewport());
  painter.setRenderHint(QPainter::SmoothPixmapTransform);
  for (QTextBlock b = firstVisibleBlock(); b.isValid(); b = b.next()) {
    if (blockBoundingGeometry(b).translated(contentOffset()).top() > viewport()->height()) break;
    const QRect place = place_of(b);
    if (place.isEmpty()) continue;
    painter.drawImage(place, picture_of_block(b)->image);
    painter.setPen(theme().line);
    painter.setBrush(Qt::NoBrush);
    painter.drawRect(place.adjusted(0, 0, -1, -1));
  }
}

void ConsoleOutput::mousePressEvent(QMouseEvent* event) {
  pressed_ = event->position().toPoint();
  if (event->button() == Qt::LeftButton && picture_at(pressed_).isValid()) return event->accept();
  QPlainTextEdit::mousePressEvent(event);
}

void ConsoleOutput::mouseReleaseEvent(QMouseEvent* event) {
  const QPoint at = event->position().toPoint();
  const QTextBlock block = picture_at(at);
  if (event->button() == Qt::LeftButton && block.isValid() && block == picture_at(pressed_)) {
    event->accept();
    return open(block);
  }
  QPlainTextEdit::mouseReleaseEvent(event);
}

void ConsoleOutput::mouseMoveEvent(QMouseEvent* event) {
  QPlainTextEdit::mouseMoveEvent(event);
  if (event->buttons() == Qt::NoButton)
    viewport()->setCursor(picture_at(event->position().toPoint()).isValid() ? Qt::PointingHandCursor
                                                                            : Qt::IBeamCursor);
}

/// Return opens the picture at the cursor, or else the newest.
void ConsoleOutput::keyPressEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter) {
    QTextBlock block = textCursor().block();
    if (!picture_of_block(block))
      for (block = document()->lastBlock(); block.isValid() && !picture_of_block(block);)
        block = block.previous();
    if (picture_of_block(block)) {
      event->accept();
      return open(block);
    }
  }
  QPlainTextEdit::keyPressEvent(event);
}

void ConsoleOutput::contextMenuEvent(QContextMenuEvent* event) {
  QMenu* menu = createStandardContextMenu(event->pos());
  menu->setObjectName("console_menu");
  menu->setAccessibleName("Lines of the console");
  menu->setAttribute(Qt::WA_DeleteOnClose);
  const QTextBlock block = picture_at(event->pos());
  if (const Picture* p = picture_of_block(block)) {
    const std::uint64_t number = p->number;
    const QImage image = p->image;
    menu->addSeparator();
    QAction* show = menu->addAction("Open the picture");
    show->setObjectName("console_picture_open");
    connect(show, &QAction::triggered, this, [this, number] { open(block_of(number)); });
    QAction* copy = menu->addAction("Copy the picture");
    copy->setObjectName("console_picture_copy");
    connect(copy, &QAction::triggered, this,
            [image] { QApplication::clipboard()->setImage(image); });
  }
  menu->popup(event->globalPos());
}

bool ConsoleOutput::viewportEvent(QEvent* event) {
  if (event->type() == QEvent::ToolTip) {
    const auto* help = static_cast<QHelpEvent*>(event);
    if (const Picture* p = picture_of_block(picture_at(help->pos()))) {
      QToolTip::showText(
          help->globalPos(),
          p->source.title + "\nClick to open in a tab; Return opens the newest picture", this);
      return true;
    }
  }
  return QPlainTextEdit::viewportEvent(event);
}

QString ConsoleOutput::text_between(int from, int to) const {
  QStringList lines;
  for (QTextBlock b = document()->findBlock(from); b.isValid() && b.position() <= to;
       b = b.next()) {
    if (picture_of_block(b)) continue;
    const int first = std::max(0, from - b.position());
    lines += b.text().mid(first, std::max(0, to - b.position() - first));
  }
  return lines.join('\n');
}

QString ConsoleOutput::text() const {
  return text_between(0, std::max(0, document()->characterCount() - 1));
}

QMimeData* ConsoleOutput::createMimeDataFromSelection() const {
  const QTextCursor cursor = textCursor();
  auto* copied = new QMimeData;
  copied->setText(text_between(cursor.selectionStart(), cursor.selectionEnd()));
  return copied;
}

}  // namespace robomosp::viewer
