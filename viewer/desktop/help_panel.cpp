// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/help_panel.h"

#include <algorithm>
#include <utility>

#include <QAbstractTextDocumentLayout>
#include <QDesktopServices>
#include <QDir>
#include <QEvent>
#include <QHBoxLayout>
#include <QLineEdit>
#include <QRegularExpression>
#include <QScrollBar>
#include <QTextBlock>
#include <QTextBrowser>
#include <QTextDocumentFragment>
#include <QTextTable>
#include <QToolButton>
#include <QUrl>
#include <QVBoxLayout>

#include "kernel/text.h"
#include "viewer/desktop/lua_highlighter.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kMostHits = 60;
constexpr std::size_t kMostVisits = 200;

/// A browser whose links we follow ourselves, and whose pictures come from the pages' folder.
class PageBrowser : public QTextBrowser {
 public:
  explicit PageBrowser(const Manual& manual) : manual_(manual) {
    setOpenLinks(false);
    setOpenExternalLinks(false);
  }
  QString file;  ///< of the page

 protected:
  QVariant loadResource(int type, const QUrl& name) override {
    if (type != QTextDocument::ImageResource || !name.isRelative()) return {};
    const QString folder = file.left(file.lastIndexOf('/') + 1);
    const QString path = QDir::cleanPath(folder + name.path());
    if (path.startsWith("..")) return {};
    const QImage image(QString::fromStdString(manual_.folder()) + "/" + path);
    if (image.isNull()) return {};
    const int widest = std::max(200, viewport()->width() - theme().px(40));
    return image.width() > widest ? image.scaledToWidth(widest, Qt::SmoothTransformation) : image;
  }

 private:
  const Manual& manual_;
};

QString head_of_link(const QString& title) {
  QString out = title;
  return out.remove('[').remove(']').remove('`');
}

/// The first sentence of Markdown.
QString first_sentence(const QString& text) {
  const QString line = text.trimmed().section("\n\n", 0, 0).simplified();
  const auto end = line.indexOf(". ");
  return end < 0 ? line : line.left(end + 1);
}

/// A page for each kind of widget that shows no command, by the object name of what is around it.
constexpr struct {
  const char* name;
  const char* page;
} kPages[] = {{"navigator", "user/desktop.md#navigator"},
              {"view_tab", "user/desktop.md#views"},
              {"timeline", "user/recordings.md"},
              {"console", "user/console.md"},
              {"messages", "user/faults.md"},
              {"properties", "user/parameters.md"},
              {"connections", "user/remote/server.md"},
              {"shortcuts", "user/desktop.md#shortcuts"},
              {"help", "user/desktop.md#help"},
              {"story", "user/desktop.md#stories"},
              {"jobs", "user/sessions.md"},
              {"guard", "user/desktop.md#closing"},
              {"start", "user/desktop.md#stories"}};

}  // namespace

QString command_in(const QString& text) {
  static const QRegularExpression call("\\b([a-z]+\\.[a-z_0-9]+)\\s*[({]");
  const QRegularExpressionMatch m = call.match(text);
  return m.hasMatch() ? m.captured(1) : QString();
}

QString help_page_of(const QWidget* widget) {
  for (const QWidget* at = widget; at; at = at->parentWidget()) {
    const QString name = at->objectName();
    for (const auto& each : kPages)
      if (name == QLatin1String(each.name)) return each.page;
    if (const QString command = command_in(at->toolTip()); !command.isEmpty())
      return "command:" + command;
  }
  return "user/desktop.md";
}

HelpPanel::HelpPanel(Desk& desk, QWidget* parent)
    : QWidget(parent),
      desk_(desk),
      manual_(desk.application().share / "docs"),
      browser_(new PageBrowser(manual_)),
      search_(new QLineEdit),
      back_(new QToolButton),
      forward_(new QToolButton),
      contents_(new QToolButton) {
  setObjectName("help");
  setAccessibleName("Help");
  setProperty("ground", "panel");
  auto* bar = new QWidget;
  bar->setObjectName("help_bar");
  bar->setAccessibleName("Where to go in the help");
  auto* across = new QHBoxLayout(bar);
  across->setContentsMargins(4, 4, 4, 4);
  const auto set_up = [&](QToolButton* button, const char* name, const char* words,
                          const char* icon_name, const char* tip) {
    button->setObjectName(name);
    button->setAccessibleName(words);
    button->setToolTip(tip);
    button->setIcon(icon(icon_name));
    button->setFocusPolicy(Qt::TabFocus);
    across->addWidget(button);
  };
  set_up(back_, "help_back", "Back", "chevron_left", "The page before (Alt+Left)");
  set_up(forward_, "help_forward", "Forward", "chevron_right", "The next page (Alt+Right)");
  set_up(contents_, "help_contents", "Contents", "list", "All chapters and topics of commands");
  back_->setShortcut(QKeySequence("Alt+Left"));
  forward_->setShortcut(QKeySequence("Alt+Right"));
  connect(back_, &QToolButton::clicked, this, [this] { back(); });
  connect(forward_, &QToolButton::clicked, this, [this] { forward(); });
  connect(contents_, &QToolButton::clicked, this, [this] { open("contents"); });
  search_->setObjectName("help_search");
  search_->setAccessibleName("Search the help");
  search_->setPlaceholderText("Search all pages and commands");
  search_->setToolTip("Words to find in all pages; Enter searches");
  search_->addAction(icon("search"), QLineEdit::LeadingPosition);
  connect(search_, &QLineEdit::returnPressed, this, [this] {
    if (const QString words = search_->text().simplified(); !words.isEmpty())
      open("search:" + words);
  });
  across->addWidget(search_, 1);
  browser_->setObjectName("help_page");
  browser_->setAccessibleName("Page");
  browser_->setToolTip("The page; Alt+Left goes back");
  browser_->setProperty("flat", true);
  connect(browser_, &QTextBrowser::anchorClicked, this, [this](const QUrl& u) { follow(u); });
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  column->addWidget(bar);
  column->addWidget(browser_, 1);
  setFocusProxy(browser_);
  apply_theme();
}

QString HelpPanel::page() const { return at_ < visits_.size() ? visits_[at_].page : QString(); }

void HelpPanel::focus_search() {
  search_->setFocus(Qt::ShortcutFocusReason);
  search_->selectAll();
}

void HelpPanel::open(const QString& page) {
  if (!visits_.empty()) {
    visits_[at_].scrolled = browser_->verticalScrollBar()->value();
    visits_.resize(at_ + 1);
  }
  if (visits_.empty() || visits_.back().page != page) visits_.push_back({page});
  if (visits_.size() > kMostVisits) visits_.erase(visits_.begin());
  at_ = visits_.size() - 1;
  show_page(page, 0);
}

void HelpPanel::back() {
  if (at_ == 0 || visits_.empty()) return;
  visits_[at_].scrolled = browser_->verticalScrollBar()->value();
  --at_;
  show_page(visits_[at_].page, visits_[at_].scrolled);
}

void HelpPanel::forward() {
  if (at_ + 1 >= visits_.size()) return;
  visits_[at_].scrolled = browser_->verticalScrollBar()->value();
  ++at_;
  show_page(visits_[at_].page, visits_[at_].scrolled);
}

void HelpPanel::show_state() {
  back_->setEnabled(at_ > 0);
  forward_->setEnabled(at_ + 1 < visits_.size());
}

void HelpPanel::show_page(const QString& page, int scrolled) {
  const int asked = ++asked_;
  show_state();
  file_.clear();
  QString anchor;
  if (!manual_.is_there()) {
    show_markdown("# The pages are not installed\n\nThey belong in `" +
                  QString::fromStdString(manual_.folder()) +
                  "`. Install the documentation of the program. Until then `help()` in the console "
                  "explains the commands.");
  } else if (page == "contents") {
    show_markdown(contents());
  } else if (page == "topics") {
    show_markdown("# Commands\n\n" + topics());
  } else if (page == "examples") {
    show_markdown(example_scripts());
  } else if (page.startsWith("search:")) {
    search_->setText(page.mid(7));
    show_markdown(found(page.mid(7)));
  } else if (page.startsWith("topic:")) {
    show_markdown(topic(page.mid(6)));
  } else if (page.startsWith("command:")) {
    const QString name = page.mid(8);
    if (const auto text = manual_.command(name)) {
      file_ = "ioci/README.md";
      show_markdown(*text);
    } else {
      // Commands of plugins have no pages; the session describes them.
      show_markdown("# " + name);
      desk_.ask(
          "help", {{"topic", utf8(name)}}, *this, [this, name, asked](const Result<Value>& r) {
            if (asked != asked_) return;
            const std::string* help = r.ok() ? r->as_string() : nullptr;
            show_markdown("# " + name + "\n\n" +
                          (help ? "```text\n" + shown(*help) + "\n```"
                                : shown(r.ok() ? "There is no page." : r.error().sentence())));
          });
    }
  } else {
    const QString name = page.section('#', 0, 0);
    anchor = page.section('#', 1);
    if (const auto text = manual_.read(name)) {
      file_ = name;
      show_markdown(*text);
    } else {
      show_markdown("# This page is not installed\n\n`" + name +
                    "` belongs to the source code of the program. The [contents](contents:) list "
                    "what is here.");
    }
  }
  browser_->verticalScrollBar()->setValue(scrolled);
  if (scrolled == 0 && !anchor.isEmpty()) scroll_to_anchor(anchor);
}

QString HelpPanel::contents() const {
  QString out = "# Help\n\n";
  QString folder;
  for (const QString& page : manual_.pages("user")) {
    const QString inside = page.section('/', 1, -2);
    if (inside != folder) {
      QString title = inside.section('/', 0, 0);
      title = title == "irl"       ? "The language IRL and controllers"
              : title == "remote"  ? "Server and clients"
              : title == "stories" ? "Longer stories"
                                   : title;
      if (inside.section('/', 0, 0) != folder.section('/', 0, 0) || folder.isEmpty())
        out += "\n## " + title + "\n\n";
      folder = inside;
    } else if (folder.isEmpty() && !out.contains("## Chapters")) {
      out += "## Chapters\n\n";
    }
    out += "- [" + head_of_link(manual_.title(page)) + "](" + page + ")\n";
  }
  return out + "\n## Commands\n\n" + topics() + "\nAnd the [scripts to run](examples:).\n";
}

QString HelpPanel::topics() const {
  QString out;
  for (const QString& page : manual_.pages("ioci"))
    if (page != "ioci/README.md") {
      const QString name = page.mid(5).chopped(3);
      out += "- [" + name + "](topic:" + name + ")\n";
    }
  return out;
}

QString HelpPanel::example_scripts() const {
  QString out = "# Scripts to run\n\n";
  for (const Manual::Script& s : manual_.scripts())
    out += "- [" + s.file.section('/', -1) + "](script:" + QUrl::toPercentEncoding(s.file, "/") +
           ") " + head_of_link(s.title) + "\n";
  return out;
}

QString HelpPanel::topic(const QString& name) const {
  const auto text = manual_.read("ioci/" + name + ".md");
  if (!text) return "# " + name + "\n\nThere are no pages of commands on this.";
  QString out = "# Commands: " + name + "\n\n| command | task |\n|---|---|\n";
  const QStringList parts = text->split("\n## ");
  for (qsizetype i = 1; i < parts.size(); ++i) {
    const QString command = parts[i].section('\n', 0, 0).trimmed();
    QString summary = first_sentence(parts[i].section('\n', 1));
    summary.replace('|', "\\|");
    out += "| [" + command + "](command:" + command + ") | " + summary + " |\n";
  }
  return out;
}

QString HelpPanel::found(const QString& words) const {
  const auto sections = manual_.search(words, kMostHits);
  QString out = "# " + QString(sections.empty() ? "Nothing found" : "Found") + ": " +
                head_of_link(words) + "\n\n";
  if (sections.empty())
    return out +
           "Try fewer words, or look at the [contents](contents:). In the console, "
           "`apropos(\"" +
           words + "\")` searches the commands, also those of plugins.\n";
  for (const ManualSection* s : sections) {
    const QString link = s->page + (s->anchor.isEmpty() ? QString() : "#" + s->anchor);
    const bool has_chapter = !s->page.startsWith("command:") && s->title != s->chapter;
    out += "- [" + head_of_link(s->title) + "](" + link + ")" +
           (has_chapter ? " in " + head_of_link(s->chapter) : QString()) + "  \n  " +
           excerpt_of(*s, words) + "\n";
  }
  return out;
}

void HelpPanel::follow(const QUrl& link) {
  const QString to = link.toString();
  if (to.startsWith("run:")) {
    const int i = to.mid(4).toInt();
    if (i >= 0 && i < examples_.size() && on_run) on_run(examples_[i]);
    return;
  }
  if (to.startsWith("script:")) {
    const QString file = QUrl::fromPercentEncoding(to.mid(7).toUtf8());
    if (on_run) on_run("dofile(" + shown(text::quote(utf8(file))) + ")");
    return;
  }
  if (to.startsWith("examples:")) return open("examples");
  if (to.startsWith("contents:")) return open("contents");
  if (to.startsWith("command:") || to.startsWith("topic:") || to.startsWith("search:"))
    return open(to);
  if (link.scheme() == "http" || link.scheme() == "https") {
    QDesktopServices::openUrl(link);
    return;
  }
  if (to.startsWith('#')) {
    const QString here = page().section('#', 0, 0);
    return open(here + to);
  }
  QString path = QDir::cleanPath(file_.left(file_.lastIndexOf('/') + 1) + link.path());
  const QString anchor = link.fragment();
  // A page of commands is long: its list, or the command that is meant.
  if (path.startsWith("ioci/") && path.endsWith(".md")) {
    if (path == "ioci/README.md") return open("contents");
    if (!anchor.isEmpty())
      if (const auto all = manual_.read(path))
        for (const QString& part : all->split("\n## "))
          if (const QString name = part.section('\n', 0, 0).trimmed();
              Manual::anchor_of(name) == anchor)
            return open("command:" + name);
    return open("topic:" + path.mid(5).chopped(3));
  }
  open(path + (anchor.isEmpty() ? QString() : "#" + anchor));
}

void HelpPanel::show_markdown(const QString& text) {
  examples_.clear();
  QString out, code;
  bool is_code = false, is_lua = false;
  for (const QString& line : text.split('\n')) {
    const bool is_fence = line.startsWith("```");
    if (is_fence && !is_code) {
      is_code = true;
      is_lua = line == "```lua";
      code.clear();
    } else if (is_fence) {
      is_code = false;
      out += line + '\n';
      // Examples that need more than the program are marked as not run.
      if (is_lua && !code.contains("-- not run") && on_run) {
        out += QString("\n[Run this example](run:%1)\n\n").arg(examples_.size());
        examples_ += code;
      }
      continue;
    } else if (is_code) {
      code += line + '\n';
    }
    out += line + '\n';
  }
  static_cast<PageBrowser*>(browser_)->file = file_;
  browser_->document()->setMarkdown(out, QTextDocument::MarkdownDialectGitHub);
  style_text();
}

void HelpPanel::style_text() {
  const Theme& t = theme();
  QTextDocument& doc = *browser_->document();
  doc.setDocumentMargin(t.gap);
  QTextCursor cursor(&doc);
  cursor.beginEditBlock();
  for (QTextBlock block = doc.begin(); block.isValid(); block = block.next()) {
    const QTextBlockFormat format = block.blockFormat();
    const int level = format.headingLevel();
    const bool is_code = format.hasProperty(QTextFormat::BlockCodeFence);
    QTextCursor at(block);
    at.movePosition(QTextCursor::EndOfBlock, QTextCursor::KeepAnchor);
    if (level > 0) {
      QTextCharFormat chars;
      chars.setFont(level == 1 ? t.title : level == 2 ? t.heading : t.menu);
      chars.setFontWeight(QFont::DemiBold);
      chars.setForeground(t.text);
      at.mergeCharFormat(chars);
      QTextBlockFormat spaced;
      spaced.setTopMargin(level == 1 ? 0 : 2 * t.gap);
      spaced.setBottomMargin(t.gap / 2.0);
      at.mergeBlockFormat(spaced);
      continue;
    }
    if (is_code) {
      QTextCharFormat chars;
      chars.setFont(t.code);
      chars.setForeground(t.text);
      at.mergeCharFormat(chars);
      QTextBlockFormat ground;
      ground.setBackground(t.field);
      ground.setLeftMargin(t.gap);
      // Long lines wrap: without that they widen the page, and the ground of short ones ends early.
      ground.setNonBreakableLines(false);
      const auto goes_on = [](const QTextBlock& beside) {
        return beside.isValid() && beside.blockFormat().hasProperty(QTextFormat::BlockCodeFence);
      };
      ground.setTopMargin(0);
      ground.setBottomMargin(goes_on(block.next()) ? 0 : t.gap);
      at.mergeBlockFormat(ground);
      if (format.stringProperty(QTextFormat::BlockCodeLanguage) == "lua")
        colour_lua(block.text(), 0, [&](int from, int length, const QColor& colour) {
          QTextCursor token(block);
          token.setPosition(block.position() + from);
          token.setPosition(block.position() + from + length, QTextCursor::KeepAnchor);
          QTextCharFormat tint;
          tint.setForeground(colour);
          token.mergeCharFormat(tint);
        });
      continue;
    }
    if (!block.textList() && !at.currentTable()) {
      QTextBlockFormat spaced;
      spaced.setBottomMargin(t.gap);
      at.mergeBlockFormat(spaced);
    }
    for (auto it = block.begin(); !it.atEnd(); ++it) {
      const QTextFragment piece = it.fragment();
      if (!piece.isValid()) continue;
      QTextCursor span(&doc);
      span.setPosition(piece.position());
      span.setPosition(piece.position() + piece.length(), QTextCursor::KeepAnchor);
      QTextCharFormat chars;
      const bool is_mono = piece.charFormat().fontFixedPitch();
      chars.setFontFamilies(is_mono ? t.code.families() : t.ui.families());
      chars.setProperty(QTextFormat::FontPixelSize,
                        is_mono ? t.mono.pixelSize() : t.ui.pixelSize());
      chars.setForeground(piece.charFormat().isAnchor() ? t.accent : t.text);
      if (piece.charFormat().isAnchor()) chars.setFontUnderline(true);
      span.mergeCharFormat(chars);
    }
  }
  const auto frames = doc.rootFrame()->childFrames();
  for (QTextFrame* frame : frames)
    if (auto* table = qobject_cast<QTextTable*>(frame)) {
      QTextTableFormat look = table->format();
      look.setBorder(1);
      look.setBorderCollapse(true);
      look.setBorderBrush(t.line);
      look.setCellPadding(t.gap / 2.0);
      look.setCellSpacing(0);
      table->setFormat(look);
    }
  cursor.endEditBlock();
}

void HelpPanel::scroll_to_anchor(const QString& anchor) {
  const QTextDocument& doc = *browser_->document();
  for (QTextBlock block = doc.begin(); block.isValid(); block = block.next()) {
    if (block.blockFormat().headingLevel() == 0 || Manual::anchor_of(block.text()) != anchor)
      continue;
    browser_->verticalScrollBar()->setValue(
        static_cast<int>(doc.documentLayout()->blockBoundingRect(block).top()));
    return;
  }
}

void HelpPanel::apply_theme() {
  const Theme& t = theme();
  use_font(*browser_, &Theme::ui);
  for (QToolButton* button : {back_, forward_, contents_})
    button->setIconSize(QSize(t.icon, t.icon));
  browser_->setStyleSheet(QString("QTextBrowser { background: %1; color: %2; border: 0px; }")
                              .arg(t.panel.name(), t.text.name()));
  if (!visits_.empty()) show_page(page(), browser_->verticalScrollBar()->value());
}

void HelpPanel::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

}  // namespace robomosp::viewer
