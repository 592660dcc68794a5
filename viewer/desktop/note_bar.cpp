// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/note_bar.h"

#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>

namespace robomosp::viewer {

NoteBar::NoteBar(const QString& name, const QString& words, const QString& words_of_text)
    : text_(new QLabel) {
  setObjectName(name);
  setAccessibleName(words);
  setProperty("ground", "header");
  setAttribute(Qt::WA_StyledBackground);
  auto* across = new QHBoxLayout(this);
  across->setContentsMargins(12, 6, 12, 6);
  text_->setObjectName(name + "_text");
  text_->setAccessibleName(words_of_text);
  text_->setToolTip(words_of_text);
  text_->setWordWrap(true);
  text_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  across->addWidget(text_, 1);
  hide();
}

QPushButton& NoteBar::add_button(const QString& name, const QString& label, const QString& tip) {
  auto* button = new QPushButton(label);
  button->setObjectName(name);
  button->setAccessibleName(label);
  button->setToolTip(tip);
  layout()->addWidget(button);
  return *button;
}

}  // namespace robomosp::viewer
