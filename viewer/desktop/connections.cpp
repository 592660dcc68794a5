// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/connections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <QAction>
#include <QCheckBox>
#include <QClipboard>
#include <QComboBox>
#include <QDateTime>
#include <QEvent>
#include <QFileDialog>
#include <QGridLayout>
#include <QGuiApplication>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QRegularExpression>
#include <QTabBar>
#include <QTabWidget>
#include <QTreeWidget>
#include <QVBoxLayout>

#include "kernel/literal.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/restyle.h"

namespace robomosp::viewer {
namespace {

constexpr int kTrafficMs = 1000;
constexpr double kLongestLine = 480;  ///< of a field of one line [px of the design]
constexpr int kMostAnswerLines = 2000;
constexpr std::size_t kMostAnswer = 20000;  ///< characters shown of an answer
constexpr double kAnswerSeconds = 60;

/// What clients may be allowed; the first three by default.
struct Right {
  const char *effect, *words, *tip;
};
constexpr std::array<Right, 7> kRights{
    {{"reads", "Read", "Look at everything"},
     {"edits", "Edit", "Change records"},
     {"simulates", "Simulate", "Run simulations, jobs and live runs"},
     {"files_read", "Read files", "Read files of its folder"},
     {"files_write", "Write files", "Write files of its folder"},
     {"processes", "Processes", "Start programs, such as a compiler"},
     {"providers", "Solvers", "Offer its own solvers"}}};

template <class W>
W* named(W* widget, const QString& name, const QString& words, const QString& tip) {
  widget->setObjectName(name);
  widget->setAccessibleName(words);
  widget->setToolTip(tip);
  return widget;
}

QTreeWidget* table(const QString& name, const QString& words, const QStringList& columns) {
  auto* t = named(new QTreeWidget, name, words, words);
  t->setColumnCount(static_cast<int>(columns.size()));
  t->setHeaderLabels(columns);
  t->setRootIsDecorated(false);
  t->setUniformRowHeights(true);
  t->setAllColumnsShowFocus(true);
  named(t->header(), name + "_header", "Columns", "Columns of the list");
  return t;
}

QString bytes_text(double bytes) {
  return bytes < 1e3   ? QString::number(bytes, 'f', 0) + " B"
         : bytes < 1e6 ? QString::number(bytes / 1e3, 'f', 1) + " kB"
                       : QString::number(bytes / 1e6, 'f', 1) + " MB";
}

QString connected_text(double s) {
  const auto whole = static_cast<qint64>(s);
  return whole < 60     ? QString("%1 s").arg(whole)
         : whole < 3600 ? QString("%1 min").arg(whole / 60)
                        : QString("%1 h %2 min").arg(whole / 3600).arg(whole / 60 % 60);
}

QString joined(const List& list) {
  QStringList out;
  for (const Value& v : list)
    if (const std::string* s = v.as_string()) out += shown(*s);
  return out.join(", ");
}

/// Rows of a table are kept by the text of their first column, so that a selection stays.
void keep_rows(QTreeWidget& t, const std::vector<QStringList>& rows) {
  const QString chosen = t.currentItem() ? t.currentItem()->text(0) : QString();
  while (t.topLevelItemCount() > static_cast<int>(rows.size()))
    delete t.takeTopLevelItem(t.topLevelItemCount() - 1);
  while (t.topLevelItemCount() < static_cast<int>(rows.size())) new QTreeWidgetItem(&t);
  for (int i = 0; i < static_cast<int>(rows.size()); ++i) {
    const QStringList& texts = rows[static_cast<std::size_t>(i)];
    QTreeWidgetItem* item = t.topLevelItem(i);
    for (int c = 0; c < static_cast<int>(texts.size()); ++c)
      if (item->text(c) != texts[c]) item->setText(c, texts[c]);
    if (!chosen.isEmpty() && texts[0] == chosen) t.setCurrentItem(item);
  }
}

}  // namespace

RightsRow::RightsRow(const QString& name, QWidget* parent) : QWidget(parent) {
  named(this, name, "Rights", QString());
  auto* across = new QHBoxLayout(this);
  across->setContentsMargins(0, 0, 0, 0);
  across->setSpacing(12);
  for (std::size_t i = 0; i < kRights.size(); ++i) {
    auto* box = named(new QCheckBox(kRights[i].words), name + "_" + kRights[i].effect,
                      kRights[i].words, kRights[i].tip);
    box->setChecked(i < 3);
    across->addWidget(box);
    boxes_.emplace_back(kRights[i].effect, box);
  }
  across->addStretch(1);
}

List RightsRow::effects() const {
  List out;
  for (const auto& [effect, box] : boxes_)
    if (box->isChecked()) out.emplace_back(effect);
  return out;
}

Result<RemoteLine> read_remote_line(const QString& text) {
  const QString line = text.trimmed();
  if (line.startsWith('='))
    return RemoteLine{"lua.eval", {{"code", utf8("return " + line.mid(1))}}};
  static const QRegularExpression call(
      "^([a-z_]+(?:\\.[a-z_0-9]+)+|help|version|apropos)\\s*(\\{.*\\})?$",
      QRegularExpression::DotMatchesEverythingOption);
  const QRegularExpressionMatch m = call.match(line);
  const bool is_classic_word = m.hasMatch() && m.captured(2).isEmpty() && !line.contains('.');
  if (!m.hasMatch() || is_classic_word) return RemoteLine{"ioci.classic", {{"line", utf8(line)}}};
  RemoteLine out{utf8(m.captured(1)), {}};
  if (m.captured(2).isEmpty()) return out;
  auto value = read_literal(utf8(m.captured(2)));
  if (!value.ok()) return value.error();
  if (const Map* map = value->as_map()) out.params = *map;
  else if (!list_of(*value).empty())
    return error(ErrorCode::invalid_argument, "the arguments have no names",
                 "Write them as {name = value}.", "line");
  return out;
}

ConnectionsPanel::ConnectionsPanel(Desk& desk, QWidget* parent)
    : QWidget(parent), desk_(desk), pages_(new QTabWidget) {
  setObjectName("connections");
  setAccessibleName("Connections");
  setProperty("ground", "panel");
  named(pages_, "connections_pages", "Server, clients, tokens, other programs", QString());
  named(pages_->tabBar(), "connections_tabs", "Pages of connections",
        "Server, clients, tokens and other programs");
  pages_->setDocumentMode(true);
  pages_->tabBar()->setExpanding(false);
  pages_->addTab(make_server(), "Server");
  pages_->addTab(make_clients(), "Clients");
  pages_->addTab(make_tokens(), "Tokens");
  pages_->addTab(make_remote(), "Other programs");
  note_ = named(new QLabel, "connections_note", "Outcome", "What happened last");
  note_->setWordWrap(true);
  note_->setContentsMargins(8, 2, 8, 4);
  note_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  note_->hide();
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  column->addWidget(pages_, 1);
  column->addWidget(note_);
  setFocusProxy(pages_);
  timer_.setInterval(kTrafficMs);
  connect(&timer_, &QTimer::timeout, this, [this] {
    if (desk_.is_idle()) refresh();
  });
  connect(pages_, &QTabWidget::currentChanged, this, [this] {
    if (pages_->currentWidget() && isVisible()) {
      refresh();
      ask_tokens();
      ask_connections();
    }
  });
  desk_.events.add(this, [this](const ioci::Event& e) {
    if (e.topic == ioci::Topic::session) return refresh();
    if (e.topic != ioci::Topic::command || !e.command) return;
    const std::string& name = e.command->command;
    if (name == "server.start" || name == "server.stop" || name == "server.kick") refresh();
    if (name == "server.grant" || name == "server.revoke") ask_tokens();
    if (name == "connection.open" || name == "connection.close" || name == "connection.reopen")
      ask_connections();
  });
  apply_theme();
  refresh();
}

void ConnectionsPanel::apply_theme() {
  for (QWidget* line : lines_) line->setMaximumWidth(theme().px(kLongestLine));
}

void ConnectionsPanel::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

// --- pages -----------------------------------------------------------------------------------

QWidget* ConnectionsPanel::make_server() {
  auto* page = named(new QWidget, "connections_server", "Server", QString());
  page->setProperty("ground", "panel");
  auto* grid = new QGridLayout(page);
  grid->setContentsMargins(8, 8, 8, 8);
  grid->setHorizontalSpacing(8);
  grid->setVerticalSpacing(6);
  about_ = named(new QLabel, "server_about", "State of the server",
                 "State of the server\nserver.status()");
  about_->setWordWrap(true);
  about_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  start_ = named(new QPushButton("Start"), "server_start", "Start the server",
                 "Let other programs work on this document\nserver.start{...}");
  start_->setProperty("filled", true);
  connect(start_, &QPushButton::clicked, this, [this] { start_or_stop(); });
  grid->addWidget(about_, 0, 0, 1, 3);
  grid->addWidget(start_, 0, 3, Qt::AlignTop);
  int row = 1;
  const auto add = [&](const QString& words, const QString& name, QWidget* field) {
    auto* label = named(new QLabel(words), name + "_label", words, words);
    label->setProperty("dim", true);
    grid->addWidget(label, row, 0);
    if (qobject_cast<QLineEdit*>(field)) {
      auto* across = new QHBoxLayout;
      across->addWidget(field, 100);
      across->addStretch(1);
      grid->addLayout(across, row, 1, 1, 3);
      lines_.push_back(field);
    } else {
      grid->addWidget(field, row, 1, 1, 3);
    }
    ++row;
  };
  address_ = named(new QLineEdit("127.0.0.1:7007"), "server_address", "Addresses",
                   "HOST:PORT, [IPv6]:PORT or unix:PATH; several with commas. Port 0 takes a free "
                   "one");
  add("Addresses", "server_address", address_);
  const auto file = [&](QLineEdit*& field, const char* name, const char* words, const char* tip) {
    field = named(new QLineEdit, name, words, tip);
    auto* choose = field->addAction(icon("folder"), QLineEdit::TrailingPosition);
    choose->setObjectName(QString(name) + "_choose");
    choose->setToolTip("Choose the file");
    connect(choose, &QAction::triggered, this, [this, target = field, words] {
      auto* dialog = new QFileDialog(this, words);
      dialog->setObjectName("connections_file_dialog");
      dialog->setAttribute(Qt::WA_DeleteOnClose);
      connect(dialog, &QFileDialog::fileSelected, target, &QLineEdit::setText);
      dialog->open();
    });
    add(words, name, field);
  };
  file(certificate_, "server_certificate", "Certificate",
       "PEM file for TLS; addresses of other machines need it");
  file(key_, "server_key", "Private key", "PEM file of the private key, readable by you only");
  auto* how = named(new QWidget, "server_how", "Who may connect", QString());
  auto* across = new QHBoxLayout(how);
  across->setContentsMargins(0, 0, 0, 0);
  needs_token_ = named(new QCheckBox("Clients of this machine need a token"), "server_needs_token",
                       "Clients of this machine need a token", "Other machines always need one");
  browser_ = named(new QCheckBox("Browsers may look"), "server_browser", "Browsers may look",
                   "A page at the same address shows the world; without a token it only views");
  across->addWidget(needs_token_);
  across->addWidget(browser_);
  across->addStretch(1);
  add("Access", "server_access", how);
  rights_ = new RightsRow("server_rights");
  add("Without a token", "server_rights_row", rights_);
  grid->setColumnStretch(1, 1);
  grid->setRowStretch(row, 1);
  return page;
}

QWidget* ConnectionsPanel::make_clients() {
  auto* page = named(new QWidget, "connections_clients", "Clients", QString());
  page->setProperty("ground", "panel");
  clients_ = table("clients_list", "Clients of the server",
                   {"Number", "Name", "Token", "Address", "Protocol", "TLS", "Connected",
                    "Requests", "Received", "Sent", "Waiting"});
  kick_ = named(new QPushButton("Close its connection"), "clients_kick",
                "Close the connection of the client",
                "Close the connection of the chosen client\nserver.kick{client = ...}");
  connect(kick_, &QPushButton::clicked, this, [this] {
    const QTreeWidgetItem* row = clients_->currentItem();
    if (!row) return show_note(*note_, "Choose a client first.", true);
    desk_.act("server.kick", {{"client", std::int64_t{row->text(0).toLongLong()}}},
              noted([this](const Value&) {
                show_note(*note_, "The connection is closed.");
                refresh();
              }));
  });
  auto* column = new QVBoxLayout(page);
  column->setContentsMargins(0, 0, 0, 0);
  column->addWidget(clients_, 1);
  auto* foot = new QHBoxLayout;
  foot->setContentsMargins(8, 0, 8, 4);
  foot->addWidget(kick_);
  foot->addStretch(1);
  column->addLayout(foot);
  return page;
}

QWidget* ConnectionsPanel::make_tokens() {
  auto* page = named(new QWidget, "connections_tokens", "Tokens", QString());
  page->setProperty("ground", "panel");
  tokens_ = table("tokens_list", "Tokens",
                  {"Name", "Rights", "Commands", "Folder", "Requests/s", "Made", "Ends"});
  auto* column = new QVBoxLayout(page);
  column->setContentsMargins(0, 0, 0, 4);
  column->addWidget(tokens_, 1);
  auto* foot = new QHBoxLayout;
  foot->setContentsMargins(8, 0, 8, 0);
  token_name_ = named(new QLineEdit, "token_name", "Name of the new token",
                      "Letters, digits, - _ and . up to 64");
  token_name_->setPlaceholderText("Name of a new token");
  token_rights_ = new RightsRow("token_rights");
  token_end_ = named(new QComboBox, "token_end", "End of the token", "How long it is valid");
  const std::pair<const char*, double> ends[] = {
      {"1 hour", 3600}, {"8 hours", 28800}, {"1 day", 86400}, {"30 days", 2592000}, {"no end", 0}};
  for (const auto& [words, seconds] : ends) token_end_->addItem(words, seconds);
  token_end_->setCurrentIndex(1);
  auto* make = named(new QPushButton("Make token"), "token_make", "Make a token",
                     "Make it; its secret is shown once\nserver.grant{name = ..., effects = ...}");
  revoke_ = named(new QPushButton("Revoke"), "token_revoke", "Revoke the chosen token",
                  "The chosen token is no longer valid; its clients are disconnected\n"
                  "server.revoke{name = ...}");
  connect(make, &QPushButton::clicked, this, [this] { make_token(); });
  connect(token_name_, &QLineEdit::returnPressed, this, [this] { make_token(); });
  connect(revoke_, &QPushButton::clicked, this, [this] {
    const QTreeWidgetItem* row = tokens_->currentItem();
    if (!row) return show_note(*note_, "Choose a token first.", true);
    const QString name = row->text(0);
    desk_.act("server.revoke", {{"name", utf8(name)}}, noted([this, name](const Value& closed) {
                show_note(*note_, QString("The token %1 is revoked; %2 connections were closed.")
                                      .arg(name)
                                      .arg(static_cast<qint64>(closed.number())));
                ask_tokens();
              }));
  });
  auto* rights = new QHBoxLayout;
  rights->setContentsMargins(8, 0, 8, 0);
  rights->addWidget(token_rights_);
  column->addLayout(rights);
  foot->addWidget(token_name_, 1);
  foot->addWidget(token_end_);
  foot->addWidget(make);
  foot->addWidget(revoke_);
  column->addLayout(foot);
  secret_row_ = named(new QWidget, "token_secret_row", "Secret of the new token", QString());
  auto* across = new QHBoxLayout(secret_row_);
  across->setContentsMargins(8, 0, 8, 0);
  auto* words = named(new QLabel("Shown only now:"), "token_secret_words", "Shown only now",
                      "Only a hash of the secret is kept");
  secret_ =
      named(new QLineEdit, "token_secret_text", "Secret", "Give it to the client; it is not kept");
  secret_->setReadOnly(true);
  auto* copy = named(new QPushButton("Copy"), "token_copy", "Copy the secret",
                     "Copy the secret to the clipboard");
  auto* done =
      named(new QPushButton("Hide"), "token_hide", "Hide the secret", "Forget the secret here");
  connect(copy, &QPushButton::clicked, this,
          [this] { QGuiApplication::clipboard()->setText(secret_->text()); });
  connect(done, &QPushButton::clicked, this, [this] { hide_secret(); });
  across->addWidget(words);
  across->addWidget(secret_, 1);
  across->addWidget(copy);
  across->addWidget(done);
  secret_row_->hide();
  column->addWidget(secret_row_);
  return page;
}

QWidget* ConnectionsPanel::make_remote() {
  auto* page = named(new QWidget, "connections_remote", "Other programs", QString());
  page->setProperty("ground", "panel");
  auto* column = new QVBoxLayout(page);
  column->setContentsMargins(8, 8, 8, 4);
  auto* head = new QHBoxLayout;
  remote_address_ = named(new QLineEdit("127.0.0.1:7007"), "remote_address",
                          "Address of the other program", "HOST:PORT, [IPv6]:PORT or unix:PATH");
  remote_token_ = named(new QLineEdit, "remote_token_text", "Token",
                        "The secret that the other program's operator gave you; empty on this "
                        "machine");
  remote_token_->setPlaceholderText("Token, if it needs one");
  remote_token_->setEchoMode(QLineEdit::Password);
  auto* open = named(new QPushButton("Connect"), "remote_connect", "Connect",
                     "Connect to the other program\nconnection.open{address = ...}");
  connect(open, &QPushButton::clicked, this, [this] { connect_remote(); });
  connect(remote_address_, &QLineEdit::returnPressed, this, [this] { connect_remote(); });
  remotes_ = named(new QComboBox, "remote_list", "Connection", "The connection that lines go to");
  auto* close = named(new QPushButton("Disconnect"), "remote_close", "Disconnect",
                      "End the chosen connection\nconnection.close(connection)");
  connect(close, &QPushButton::clicked, this, [this] {
    if (remotes_->currentIndex() < 0) return show_note(*note_, "There is no connection.", true);
    desk_.act("connection.close",
              {{"connection", std::int64_t{remotes_->currentData().toLongLong()}}},
              noted([this](const Value&) { ask_connections(); }));
  });
  head->addWidget(remote_address_, 2);
  head->addWidget(remote_token_, 1);
  head->addWidget(open);
  head->addWidget(remotes_, 2);
  head->addWidget(close);
  column->addLayout(head);
  answers_ = named(new QPlainTextEdit, "remote_answers", "Lines and answers",
                   "Lines that were sent, and their answers");
  answers_->setReadOnly(true);
  answers_->setMaximumBlockCount(kMostAnswerLines);
  answers_->setProperty("flat", true);
  use_font(*answers_, &Theme::code);
  column->addWidget(answers_, 1);
  auto* foot = new QHBoxLayout;
  line_ = named(new QLineEdit, "remote_line", "Line for the other program",
                "robot.list{} calls a command, = 1 + 1 evaluates Lua, other lines are classic; Up "
                "and Down repeat earlier ones");
  line_->setPlaceholderText("A command such as world.list{}, a classic line, or = Lua");
  use_font(*line_, &Theme::code);
  send_ = named(new QPushButton("Send"), "remote_send", "Send the line",
                "Send the line\nconnection.call{connection = ..., method = ...}");
  stop_ = named(new QPushButton("Stop"), "remote_stop", "Stop waiting",
                "Cancel the call on the other program");
  stop_->setEnabled(false);
  connect(line_, &QLineEdit::returnPressed, this, [this] { send(); });
  connect(send_, &QPushButton::clicked, this, [this] { send(); });
  connect(stop_, &QPushButton::clicked, this, [this] { desk_.client().cancel(calling_); });
  for (const auto& [key, by] : {std::pair{"Up", -1}, std::pair{"Down", 1}}) {
    auto* earlier = new QAction(line_);
    earlier->setObjectName(QString("remote_line_") + key);
    earlier->setShortcut(QKeySequence(key));
    earlier->setShortcutContext(Qt::WidgetShortcut);
    connect(earlier, &QAction::triggered, this, [this, step = by] {
      if (sent_.isEmpty()) return;
      at_ = std::clamp<qsizetype>(at_ + step, 0, sent_.size());
      line_->setText(at_ < sent_.size() ? sent_[at_] : QString());
    });
    line_->addAction(earlier);
  }
  foot->addWidget(line_, 1);
  foot->addWidget(send_);
  foot->addWidget(stop_);
  column->addLayout(foot);
  return page;
}

// --- state -----------------------------------------------------------------------------------

Desk::Done ConnectionsPanel::noted(std::function<void(const Value&)> done) {
  return [this, done = std::move(done)](const Result<Value>& r) {
    if (r.ok()) return done ? done(*r) : void();
    show_note(*note_, shown(r.error().sentence()), true);
    desk_.failed(r.error());
  };
}

void ConnectionsPanel::refresh() {
  desk_.ask("server.status", {}, *this, [this](const Result<Value>& r) {
    if (r.ok()) take_state(map_of(*r));
  });
  if (!state_.is_running || !isVisible()) return;
  desk_.ask("server.clients", {}, *this, [this](const Result<Value>& r) {
    if (r.ok()) take_clients(list_of(*r));
  });
}

void ConnectionsPanel::take_state(const Map& status) {
  State now;
  now.is_running = flag_at(status, "is_running");
  now.has_tls = flag_at(status, "has_tls");
  now.has_browser = flag_at(status, "browser");
  now.clients = static_cast<int>(whole_at(status, "clients"));
  for (const Value& v : list_at(status, "addresses"))
    if (const std::string* a = v.as_string()) now.addresses += shown(*a);
  const bool was_running = state_.is_running;
  state_ = std::move(now);
  QString text = "Local only: no other program can connect.";
  if (state_.is_running) {
    text = QString("Listens at %1. Protocols: JSON-RPC and classic lines%2. TLS: %3. Clients: %4.")
               .arg(state_.addresses.join(", "),
                    state_.has_browser ? ", pages and WebSockets for browsers" : "",
                    state_.has_tls ? "yes" : "no")
               .arg(state_.clients);
    if (const std::string file = text_at(status, "token_file"); !file.empty())
      text += " Tokens: " + shown(file) + ".";
  }
  about_->setText(text);
  start_->setText(state_.is_running ? "Stop" : "Start");
  start_->setAccessibleName(state_.is_running ? "Stop the server" : "Start the server");
  start_->setToolTip(state_.is_running
                         ? "Tell all clients and stop\nserver.stop()"
                         : "Let other programs work on this document\nserver.start{...}");
  for (QWidget* each : {static_cast<QWidget*>(address_), static_cast<QWidget*>(certificate_),
                        static_cast<QWidget*>(key_), static_cast<QWidget*>(needs_token_),
                        static_cast<QWidget*>(browser_), static_cast<QWidget*>(rights_)})
    each->setEnabled(!state_.is_running);
  pages_->setTabText(
      1, state_.clients > 0 ? QString("Clients %1").arg(state_.clients) : QString("Clients"));
  if (!state_.is_running) take_clients({});
  if (state_.is_running && isVisible()) {
    timer_.start();
    if (!was_running) refresh();
  } else {
    timer_.stop();
  }
  changed();
}

void ConnectionsPanel::take_clients(const List& rows) {
  std::vector<QStringList> texts;
  for (const Value& v : rows) {
    const Map& c = map_of(v);
    const std::string token = text_at(c, "token"), protocol = text_at(c, "protocol");
    texts.push_back({QString::number(whole_at(c, "number")), shown(text_at(c, "name")),
                     token.empty() ? "none" : shown(token), shown(text_at(c, "peer")),
                     protocol.empty() ? "none yet" : shown(protocol),
                     flag_at(c, "has_tls") ? "yes" : "no", connected_text(number_at(c, "seconds")),
                     QString::number(whole_at(c, "requests")), bytes_text(number_at(c, "bytes_in")),
                     bytes_text(number_at(c, "bytes_out")),
                     QString::number(whole_at(c, "waiting"))});
  }
  keep_rows(*clients_, texts);
  kick_->setEnabled(!texts.empty());
  if (clients_->topLevelItemCount() > 0 && !clients_->currentItem())
    clients_->setCurrentItem(clients_->topLevelItem(0));
}

void ConnectionsPanel::ask_tokens() {
  desk_.ask("server.tokens", {}, *this, [this](const Result<Value>& r) {
    if (r.ok()) take_tokens(list_of(*r));
    else show_note(*note_, shown(r.error().sentence()), true);
  });
}

void ConnectionsPanel::take_tokens(const List& rows) {
  std::vector<QStringList> texts;
  const auto date = [](std::int64_t seconds) {
    return QDateTime::fromSecsSinceEpoch(seconds).toString("yyyy-MM-dd HH:mm");
  };
  for (const Value& v : rows) {
    const Map& t = map_of(v);
    const std::int64_t rate = whole_at(t, "rate");
    const bool has_end = t.find("expires") && whole_at(t, "expires") > 0;
    texts.push_back(
        {shown(text_at(t, "name")), joined(list_at(t, "effects")), joined(list_at(t, "commands")),
         text_at(t, "folder").empty() ? "anywhere" : shown(text_at(t, "folder")),
         rate > 0 ? QString::number(rate) : "server's limit", date(whole_at(t, "created")),
         has_end ? date(whole_at(t, "expires")) : "never"});
  }
  keep_rows(*tokens_, texts);
  revoke_->setEnabled(!texts.empty());
}

void ConnectionsPanel::ask_connections() {
  desk_.ask("connection.list", {}, *this, [this](const Result<Value>& r) {
    if (r.ok()) take_connections(list_of(*r));
  });
}

void ConnectionsPanel::take_connections(const List& rows) {
  const qlonglong chosen = remotes_->currentData().toLongLong();
  remotes_->clear();
  for (const Value& v : rows) {
    const Map& c = map_of(v);
    remotes_->addItem(
        QString("%1: %2%3")
            .arg(whole_at(c, "connection"))
            .arg(shown(text_at(c, "address")), flag_at(c, "is_open") ? "" : " (lost)"),
        static_cast<qlonglong>(whole_at(c, "connection")));
  }
  const int at = remotes_->findData(chosen);
  remotes_->setCurrentIndex(at >= 0 ? at : remotes_->count() - 1);
}

QString ConnectionsPanel::summary() const {
  if (!state_.is_running) return "local only";
  return state_.addresses.value(0) + (state_.addresses.size() > 1 ? ", ..." : "") +
         QString(", %1 %2").arg(state_.clients).arg(state_.clients == 1 ? "client" : "clients");
}

// --- acts ------------------------------------------------------------------------------------

void ConnectionsPanel::start_or_stop() {
  show_note(*note_, {});
  if (state_.is_running) {
    desk_.act("server.stop", {}, noted([this](const Value&) { refresh(); }));
    return;
  }
  List addresses;
  for (const QString& each : address_->text().split(',', Qt::SkipEmptyParts))
    addresses.emplace_back(utf8(each.trimmed()));
  Map args;
  if (!addresses.empty()) args.set("addresses", std::move(addresses));
  if (!certificate_->text().isEmpty()) args.set("certificate", utf8(certificate_->text()));
  if (!key_->text().isEmpty()) args.set("key", utf8(key_->text()));
  if (needs_token_->isChecked()) args.set("needs_token", true);
  if (browser_->isChecked()) args.set("browser", true);
  args.set("effects", rights_->effects());
  desk_.act("server.start", std::move(args), noted([this](const Value&) { refresh(); }));
}

void ConnectionsPanel::make_token() {
  hide_secret();
  const QString name = token_name_->text().trimmed();
  if (name.isEmpty()) return show_note(*note_, "Give the token a name first.", true);
  Map args{{"name", utf8(name)}, {"effects", token_rights_->effects()}};
  if (const double seconds = token_end_->currentData().toDouble(); seconds > 0)
    args.set("valid_for", seconds);
  desk_.act("server.grant", std::move(args), noted([this, name](const Value& secret) {
              const std::string* text = secret.as_string();
              if (!text) return;
              secret_->setText(shown(*text));
              secret_row_->show();
              token_name_->clear();
              show_note(*note_, "The token " + name + " is valid now.");
              ask_tokens();
            }));
}

void ConnectionsPanel::hide_secret() {
  secret_->clear();
  secret_row_->hide();
}

void ConnectionsPanel::connect_remote() {
  show_note(*note_, {});
  Map args{{"address", utf8(remote_address_->text().trimmed())}, {"client", "robomosp-desktop"}};
  if (!remote_token_->text().isEmpty()) args.set("token", utf8(remote_token_->text().trimmed()));
  desk_.act("connection.open", std::move(args), noted([this](const Value& made) {
              remote_token_->clear();
              const Map& server = map_of(made);
              show_note(*note_, QString("Connected to %1.").arg(shown(text_at(server, "address"))));
              ask_connections();
              line_->setFocus();
            }));
}

void ConnectionsPanel::send() {
  const QString text = line_->text().trimmed();
  if (text.isEmpty()) return;
  if (remotes_->currentIndex() < 0)
    return show_note(*note_, "Connect to another program first; then lines can be sent to it.",
                     true);
  auto read = read_remote_line(text);
  if (!read.ok()) return show_note(*note_, shown(read.error().sentence()), true);
  show_note(*note_, {});
  sent_.removeAll(text);
  sent_ += text;
  at_ = sent_.size();
  line_->clear();
  answers_->appendPlainText(QString(QChar(0x203A)) + ' ' + text);
  stop_->setEnabled(true);
  Map args{{"connection", std::int64_t{remotes_->currentData().toLongLong()}},
           {"method", read->method},
           {"timeout", kAnswerSeconds}};
  if (!read->params.empty()) args.set("params", std::move(read->params));
  calling_ = desk_.act("connection.call", std::move(args), [this](const Result<Value>& r) {
    stop_->setEnabled(false);
    if (!r.ok()) {
      answers_->appendPlainText("error: " + shown(r.error().sentence()));
      return;
    }
    const std::string* plain = r->as_string();
    std::string answer = plain ? *plain : beginning_of_literal(*r, kMostAnswer);
    const bool is_long = answer.size() > kMostAnswer;
    answer.resize(std::min(answer.size(), kMostAnswer));
    answers_->appendPlainText(shown(answer) + (is_long ? " ..." : ""));
  });
}

void ConnectionsPanel::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  refresh();
  ask_tokens();
  ask_connections();
}

void ConnectionsPanel::hideEvent(QHideEvent* event) {
  QWidget::hideEvent(event);
  timer_.stop();
  hide_secret();
}

}  // namespace robomosp::viewer
