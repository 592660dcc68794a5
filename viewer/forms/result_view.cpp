// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/result_view.h"

#include <algorithm>

#include <QAbstractTableModel>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QStackedWidget>
#include <QTableView>
#include <QVBoxLayout>

#include "kernel/literal.h"
#include "kernel/units.h"
#include "viewer/forms/form_context.h"
#include "viewer/forms/plot_view.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/choice_field.h"
#include "viewer/widgets/field.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kLongestText = 200'000;  // bytes of a value shown as text

const char* const kModes[] = {"plot", "table", "picture", "value"};

QString cell_text(const Value& v) {
  if (v.is_nil()) return {};
  if (v.is_number()) return number_text(v.number());
  if (v.as_string()) return qt(*v.as_string());
  constexpr std::size_t kMost = 120;
  const std::string s = beginning_of_literal(v, kMost);
  return qt(s.size() > kMost ? s.substr(0, kMost) + "…" : s);
}

class ResultModel : public QAbstractTableModel {
 public:
  explicit ResultModel(ResultTable table, QObject* parent)
      : QAbstractTableModel(parent), table_(std::move(table)) {}
  int rowCount(const QModelIndex& parent) const override {
    return parent.isValid() ? 0 : static_cast<int>(table_.rows.size());
  }
  int columnCount(const QModelIndex& parent) const override {
    return parent.isValid() ? 0 : static_cast<int>(table_.columns.size());
  }
  QVariant data(const QModelIndex& index, int role) const override {
    const auto& row = table_.rows[static_cast<std::size_t>(index.row())];
    const auto c = static_cast<std::size_t>(index.column());
    if (c >= row.size()) return {};
    if (role == Qt::DisplayRole || role == Qt::ToolTipRole) return cell_text(row[c]);
    if (role == Qt::TextAlignmentRole && row[c].is_number())
      return QVariant::fromValue(Qt::AlignRight | Qt::AlignVCenter);
    if (role == Qt::FontRole && row[c].is_number()) return theme().mono;
    return {};
  }
  QVariant headerData(int section, Qt::Orientation orientation, int role) const override {
    if (role != Qt::DisplayRole) return {};
    if (orientation == Qt::Vertical) return section + 1;
    const auto c = static_cast<std::size_t>(section);
    QString s = qt(table_.columns[c]);
    if (c < table_.units.size() && !table_.units[c].empty())
      s += " [" + unit_text(table_.units[c]) + "]";
    return s;
  }

 private:
  ResultTable table_;
};

bool is_plain(const Value& v) { return !v.as_list() && !v.as_map() && !v.as_array(); }

bool rises(const std::vector<std::vector<Value>>& rows) {
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (!(rows[i][0].number() > rows[i - 1][0].number())) return false;
  return rows.size() > 2;
}

std::shared_ptr<PlotData> plot_of(const ResultTable& table) {
  auto out = std::make_shared<PlotData>();
  if (table.columns.empty()) return out;
  const auto unit = [&](std::size_t c) { return c < table.units.size() ? table.units[c] : ""; };
  out->x_name = table.columns[0];
  out->x_unit = unit(0);
  for (const auto& row : table.rows) out->x.push_back(row.empty() ? 0 : row[0].number());
  for (std::size_t c = 1; c < table.columns.size(); ++c) {
    PlotData::Column column{table.columns[c], unit(c), {}};
    for (const auto& row : table.rows)
      column.values.push_back(c < row.size() ? row[c].number() : 0);
    out->columns.push_back(std::move(column));
  }
  return out;
}

}  // namespace

ResultTable table_of(const Value& v) {
  ResultTable t;
  if (const NumericArray* a = v.as_array()) {
    const std::size_t cols = a->is_matrix() ? a->cols() : 1;
    for (std::size_t c = 0; c < cols; ++c) {
      t.columns.push_back(a->is_matrix() ? std::to_string(c + 1) : "value");
      t.units.push_back(a->unit());
    }
    for (std::size_t r = 0; r < a->rows(); ++r) {
      t.rows.emplace_back();
      for (std::size_t c = 0; c < cols; ++c) t.rows.back().emplace_back((*a)[r * cols + c]);
    }
    return t;
  }
  if (const List* list = v.as_list()) {
    if (list->empty()) return t;
    const bool are_maps = std::all_of(list->begin(), list->end(),
                                      [](const Value& e) { return e.as_map() != nullptr; });
    if (are_maps) {
      for (const Value& each : *list)
        for (const auto& [name, value] : *each.as_map())
          if (std::find(t.columns.begin(), t.columns.end(), name) == t.columns.end())
            t.columns.push_back(name);
      for (const Value& each : *list) {
        t.rows.emplace_back();
        for (const std::string& name : t.columns) {
          const Value* cell = each.as_map()->find(name);
          t.rows.back().push_back(cell ? *cell : Value());
        }
      }
      return t;
    }
    const bool are_rows = std::all_of(list->begin(), list->end(),
                                      [](const Value& e) { return e.as_list() || e.as_array(); });
    if (are_rows) {
      std::size_t cols = 0;
      for (const Value& each : *list) {
        t.rows.push_back(elements_of(each));
        cols = std::max(cols, t.rows.back().size());
      }
      for (auto& row : t.rows) row.resize(cols);
      for (std::size_t c = 0; c < cols; ++c) t.columns.push_back(std::to_string(c + 1));
      return t;
    }
    t.columns = {"value"};
    for (const Value& each : *list) t.rows.push_back({each});
    return t;
  }
  if (const Map* m = v.as_map()) {
    if (m->empty()) return t;
    // Columns of equal length.
    std::size_t length = 0;
    bool are_columns = m->size() > 1;
    for (const auto& [name, value] : *m) {
      const auto parts = elements_of(value);
      if (parts.size() < 2 || (length != 0 && parts.size() != length) ||
          !std::all_of(parts.begin(), parts.end(), is_plain))
        are_columns = false;
      else length = parts.size();
    }
    if (are_columns) {
      t.rows.resize(length);
      for (const auto& [name, value] : *m) {
        t.columns.push_back(name);
        t.units.push_back(value.as_array() ? value.as_array()->unit() : "");
        const auto parts = elements_of(value);
        for (std::size_t r = 0; r < length; ++r) t.rows[r].push_back(parts[r]);
      }
      t.is_curve = std::all_of(t.rows.begin(), t.rows.end(),
                               [](const auto& row) {
                                 return std::all_of(row.begin(), row.end(),
                                                    [](const Value& e) { return e.is_number(); });
                               }) &&
                   rises(t.rows);
      return t;
    }
    t.columns = {"field", "value"};
    for (const auto& [name, value] : *m) t.rows.push_back({Value(name), value});
  }
  return t;
}

ResultView::ResultView(ioci::Client& client, QWidget* parent) : QWidget(parent), client_(client) {
  const Theme& t = theme();
  setObjectName("result");
  setAccessibleName("Result");
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  tabs_ = new QWidget(this);
  tabs_->setProperty("ground", "header");
  tabs_->setAttribute(Qt::WA_StyledBackground);
  auto* row = new QHBoxLayout(tabs_);
  row->setContentsMargins(t.px(4), t.px(2), t.px(4), t.px(2));
  row->setSpacing(t.px(4));
  const char* const names[] = {"Plot", "Table", "Picture", "Value"};
  for (std::size_t i = 0; i < 4; ++i) {
    auto* b = new QPushButton(names[i], tabs_);
    style_as_segment(b);
    b->setObjectName(QString("result.as_") + kModes[i]);
    b->setAccessibleName(QString("Result as ") + kModes[i]);
    b->setToolTip(b->accessibleName());
    QObject::connect(b, &QPushButton::clicked, this, [this, i] { show_mode(kModes[i]); });
    row->addWidget(b);
    buttons_.push_back(b);
  }
  row->addStretch();
  units_ = new ChoiceField(tabs_);
  units_->setFixedWidth(t.px(140));
  units_->set_may_be_empty(false);
  units_->describe("Columns", "Which columns of the plot are shown, by their unit.", {},
                   "result.units");
  units_->on_change = [this](Field::Stage) { show_units(); };
  row->addWidget(units_);
  column->addWidget(tabs_);
  stack_ = new QStackedWidget(this);
  plot_ = new PlotView(stack_);
  plot_->setObjectName("result.plot");
  table_ = new QTableView(stack_);
  table_->setObjectName("result.table");
  table_->setAccessibleName("Result as a table");
  table_->setToolTip("Ctrl+C copies the selected cells.");
  table_->verticalHeader()->setDefaultSectionSize(t.row);
  table_->horizontalHeader()->setStretchLastSection(true);
  table_->setShowGrid(false);
  picture_ = new QLabel(stack_);
  picture_->setObjectName("result.picture");
  picture_->setAccessibleName("Result as a picture");
  picture_->setToolTip("The picture that the command made");
  picture_->setAlignment(Qt::AlignCenter);
  picture_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Ignored);
  text_ = new QPlainTextEdit(stack_);
  text_->setObjectName("result.value");
  text_->setAccessibleName("Result as Lua");
  text_->setToolTip("The value as Lua");
  text_->setReadOnly(true);
  use_font(*text_, &Theme::code);
  text_->setTabChangesFocus(true);
  stack_->addWidget(plot_);
  stack_->addWidget(table_);
  stack_->addWidget(picture_);
  stack_->addWidget(text_);
  column->addWidget(stack_, 1);
  set_modes({});
}

std::string ResultView::shown_mode() const {
  return modes_.empty() ? std::string() : kModes[stack_->currentIndex()];
}

void ResultView::set_modes(std::vector<std::string> modes) {
  modes_ = std::move(modes);
  for (std::size_t i = 0; i < 4; ++i)
    buttons_[i]->setVisible(std::find(modes_.begin(), modes_.end(), kModes[i]) != modes_.end());
  if (!modes_.empty()) show_mode(modes_.front());
}

void ResultView::set_plot(std::shared_ptr<const PlotData> plotted) {
  // Panels lower than this cannot be read: then one unit is shown at first.
  constexpr std::size_t kMostPanels = 3;
  std::vector<std::string> units;
  for (const PlotData::Column& c : plotted->columns)
    if (std::find(units.begin(), units.end(), c.unit) == units.end()) units.push_back(c.unit);
  std::vector<FieldChoice> choices{{Value("all"), "all columns", {}, {}}};
  for (const std::string& unit : units) {
    QStringList names;
    for (const PlotData::Column& c : plotted->columns)
      if (c.unit == unit) names << qt(c.name);
    choices.push_back({Value("=" + unit),
                       unit.empty() ? QString("no unit") : unit_text(unit),
                       names.join(", "),
                       {}});
  }
  units_->set_choices(std::move(choices));
  units_->set_value(Value(units.size() <= kMostPanels ? "all" : "=" + units.front()));
  plot_->show_data(std::move(plotted));
  show_units();
}

void ResultView::show_units() {
  const auto chosen = units_->value();
  const PlotData* plotted = plot_->data();
  for (std::size_t i = 0; plotted && i < plotted->columns.size(); ++i)
    plot_->set_shown(
        i, !chosen || *chosen == Value("all") || *chosen == Value("=" + plotted->columns[i].unit));
}

void ResultView::show_mode(const std::string& mode) {
  for (std::size_t i = 0; i < 4; ++i) {
    buttons_[i]->setChecked(mode == kModes[i]);
    if (mode == kModes[i]) stack_->setCurrentIndex(static_cast<int>(i));
  }
  units_->setVisible(mode == "plot");
}

void ResultView::clear() {
  ++asked_;
  set_modes({});
  text_->clear();
  pixmap_ = {};
}

void ResultView::show_table(ResultTable table) {
  QAbstractItemModel* before = table_->model();
  table_->setModel(new ResultModel(std::move(table), table_));
  delete before;
  table_->resizeColumnsToContents();
}

void ResultView::show_result(const Value& result, const std::string& unit) {
  ++asked_;
  if (const Handle* h = result.as_handle(); h && h->kind == "recording") return show_recording(*h);
  std::vector<std::string> modes;
  if (const Map* m = result.as_map())
    if (const Value* file = m->find("file");
        file && file->as_string() && show_picture_file(*file->as_string()))
      modes.emplace_back("picture");
  if (const std::string* s = result.as_string()) {
    if (show_picture_file(*s)) modes.emplace_back("picture");
    text_->setPlainText(qt(s->substr(0, kLongestText)));
  } else {
    std::string beginning = beginning_of_literal(result, kLongestText);
    if (beginning.size() > kLongestText) beginning += " …";
    QString shown = result.is_nil() ? QString("no value") : qt(beginning);
    if (result.is_number() && !unit.empty()) shown += " " + unit_text(unit);
    text_->setPlainText(shown);
  }
  ResultTable table = table_of(result);
  if (!table.columns.empty()) {
    if (table.is_curve) {
      set_plot(plot_of(table));
      modes.insert(modes.begin(), "plot");
    }
    modes.emplace_back("table");
    show_table(std::move(table));
  }
  modes.emplace_back("value");
  set_modes(std::move(modes));
}

void ResultView::show_recording(const Handle& recording) {
  const int number = asked_;
  text_->setPlainText(qt(recording.kind + "#" + std::to_string(recording.number)));
  set_modes({"value"});
  ask(client_, "recording.columns", Map{{"id", recording}}, this,
      [this, number, recording](const Result<Value>& r) {
        if (number != asked_ || !r.ok() || !r->as_list()) return;
        ResultTable table;
        List names;
        for (const Value& each : *r->as_list())
          if (const Map* m = each.as_map()) {
            const Value* name = m->find("name");
            const Value* unit = m->find("unit");
            table.columns.push_back(name ? name->text() : "");
            table.units.push_back(unit && unit->as_string() ? *unit->as_string() : "");
            names.emplace_back(table.columns.back());
          }
        ask(client_, "recording.values", Map{{"id", recording}, {"columns", names}}, this,
            [this, number, table](const Result<Value>& values) {
              if (number != asked_ || !values.ok() || !values->as_array()) return;
              ResultTable whole = table;
              const NumericArray& a = *values->as_array();
              const std::size_t cols = a.is_matrix() ? a.cols() : 1;
              for (std::size_t row = 0; row < a.rows(); ++row) {
                whole.rows.emplace_back();
                for (std::size_t c = 0; c < cols; ++c)
                  whole.rows.back().emplace_back(a[row * cols + c]);
              }
              std::vector<std::string> modes;
              if (rises(whole.rows) && cols > 1) {
                set_plot(plot_of(whole));
                modes.emplace_back("plot");
              }
              show_table(std::move(whole));
              modes.emplace_back("table");
              modes.emplace_back("value");
              set_modes(std::move(modes));
            });
      });
  ask(client_, "recording.overview", Map{{"id", recording}}, this,
      [this, number](const Result<Value>& r) {
        if (number == asked_ && r.ok() && r->as_string()) text_->setPlainText(qt(*r->as_string()));
      });
}

bool ResultView::show_picture_file(const std::string& file) {
  const QString name = qt(file);
  if (!name.endsWith(".png", Qt::CaseInsensitive) && !name.endsWith(".gif", Qt::CaseInsensitive))
    return false;
  pixmap_ = QPixmap(name);
  if (pixmap_.isNull()) return false;
  fit_picture();
  return true;
}

void ResultView::fit_picture() {
  if (pixmap_.isNull()) return;
  const double ratio = devicePixelRatioF();
  QPixmap fitted =
      pixmap_.scaled(stack_->size() * ratio, Qt::KeepAspectRatio, Qt::SmoothTransformation);
  fitted.setDevicePixelRatio(ratio);
  picture_->setPixmap(fitted);
}

void ResultView::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange)
    for (QPushButton* b : buttons_) style_as_segment(b);
  QWidget::changeEvent(event);
}

void ResultView::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fit_picture();
}

}  // namespace robomosp::viewer
