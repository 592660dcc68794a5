// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/result_picture.h"

#include <array>
#include <string_view>

#include <QBuffer>
#include <QFile>
#include <QImageReader>
#include <QPainter>
#include <QSvgRenderer>

#include "kernel/base64.h"
#include "viewer/widgets/field.h"

namespace robomosp::viewer {
namespace {

constexpr std::string_view kPngInBase64 = "iVBORw0KGgo";
constexpr qint64 kLargestFile = 64LL << 20;  ///< [bytes]

std::optional<ResultPicture> of_base64(const std::string& text) {
  const auto size = base64::decoded_size(text);
  if (!text.starts_with(kPngInBase64) || !size) return std::nullopt;
  ResultPicture p;
  p.bytes.resize(static_cast<qsizetype>(*size));
  if (!base64::decode(text, p.bytes.data())) return std::nullopt;
  p.title = "picture";
  p.text = text;
  return p;
}

std::optional<ResultPicture> of_file(const std::string& name) {
  constexpr std::array kEndings{".png", ".svg", ".gif", ".jpg", ".jpeg"};
  const QString file = qt(name);
  for (const char* ending : kEndings)
    if (file.endsWith(ending, Qt::CaseInsensitive) && !file.contains('\n'))
      return ResultPicture{file.section('/', -1), file, {}, {}};
  return std::nullopt;
}

/// An SVG picture scaled into `most`, its shape kept; null if the text is none.
QImage draw_svg(const QByteArray& svg, QSize most) {
  constexpr qsizetype kLargest = 4 << 20;  // of a picture that is drawn while others wait [bytes]
  if (svg.size() > kLargest || !svg.left(1024).contains("<svg")) return {};
  QSvgRenderer renderer(svg);
  const QSize size = renderer.defaultSize();
  if (!renderer.isValid() || size.isEmpty() || most.isEmpty()) return {};
  QImage image(size.scaled(most, Qt::KeepAspectRatio).expandedTo({1, 1}), QImage::Format_RGB32);
  image.fill(Qt::white);
  QPainter painter(&image);
  renderer.render(&painter);
  return image;
}

}  // namespace

std::optional<ResultPicture> picture_of(const Value& result) {
  if (const Map* m = result.as_map()) {
    const Value *png = m->find("png"), *file = m->find("file");
    if (const std::string* text = png ? png->as_string() : nullptr) return of_base64(*text);
    if (const std::string* name = file ? file->as_string() : nullptr) return of_file(*name);
    return std::nullopt;
  }
  const std::string* text = result.as_string();
  if (!text) return std::nullopt;
  if (text->starts_with("<svg ")) {
    ResultPicture p;
    p.title = "plot";
    p.bytes = QByteArray(text->data(), static_cast<qsizetype>(text->size()));
    p.text = *text;
    return p;
  }
  if (auto picture = of_base64(*text)) return picture;
  return of_file(*text);
}

QImage draw_picture(const ResultPicture& picture, QSize most) {
  QByteArray bytes = picture.bytes;
  if (!picture.file.isEmpty()) {
    QFile file(picture.file);
    if (!file.open(QIODevice::ReadOnly) || file.size() > kLargestFile) return {};
    bytes = file.readAll();
  }
  if (QImage plot = draw_svg(bytes, most); !plot.isNull()) return plot;
  QBuffer buffer(&bytes);
  QImageReader reader(&buffer);
  const QSize size = reader.size();
  if (size.isValid() && (size.width() > most.width() || size.height() > most.height()))
    reader.setScaledSize(size.scaled(most, Qt::KeepAspectRatio).expandedTo({1, 1}));
  return reader.read();
}

}  // namespace robomosp::viewer
