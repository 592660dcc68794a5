// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/theme/contrast.h"

#include <algorithm>
#include <cmath>

namespace robomosp::viewer {
namespace {

double luminance(const QColor& c) {
  const auto linear = [](double v) {
    return v <= 0.03928 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.redF()) + 0.7152 * linear(c.greenF()) + 0.0722 * linear(c.blueF());
}

}  // namespace

double contrast(const QColor& a, const QColor& b) {
  const double x = luminance(a), y = luminance(b);
  return (std::max(x, y) + 0.05) / (std::min(x, y) + 0.05);
}

std::vector<PaletteRow> contrast_table(const Theme& t) {
  std::vector<PaletteRow> out{
      {"window, gaps", t.window},    {"panel", t.panel}, {"header, bars", t.header},
      {"field, editor", t.field},    {"hover", t.hover}, {"separator", t.line},
      {"field border", t.field_line}};
  const auto on_panel = [&](const char* name, const QColor& colour) {
    out.push_back({name, colour, contrast(colour, t.panel)});
  };
  on_panel("text", t.text);
  on_panel("second text", t.text_dim);
  on_panel("quiet text", t.text_quiet);
  on_panel("accent", t.accent);
  out.push_back({"accent fill", t.accent_fill});
  out.push_back({"selection", t.selection});
  on_panel("good", t.ok);
  on_panel("look at", t.warn);
  on_panel("fault", t.fault);
  out.push_back({"fault ground", t.fault_ground});
  out.push_back({"disabled", t.disabled});
  const char* const axes[] = {"x axis", "y axis", "z axis"};
  for (std::size_t i = 0; i < 3; ++i) out.push_back({axes[i], t.axes[i]});
  for (std::size_t i = 0; i < t.series.size(); ++i)
    out.push_back({QString("series %1").arg(i + 1), t.series[i], contrast(t.series[i], t.panel)});
  return out;
}

std::vector<TextPair> text_pairs(const Theme& t) {
  struct Named {
    const char* name;
    QColor colour;
  };
  const Named grounds[] = {{"window", t.window},
                           {"panel", t.panel},
                           {"header", t.header},
                           {"field", t.field},
                           {"hover", t.hover},
                           {"selection", t.selection},
                           {"selection without focus", t.selection_idle}};
  std::vector<TextPair> out;
  const auto add = [&](const Named& text, const Named& ground) {
    out.push_back({text.name, ground.name, text.colour, ground.colour});
  };
  for (const Named& ground : grounds)
    for (const Named& text : {Named{"text", t.text}, Named{"second text", t.text_dim}})
      add(text, ground);
  const Named quiet_grounds[] = {grounds[1], grounds[2], grounds[3]};
  for (const Named& ground : quiet_grounds)
    for (const Named& text :
         {Named{"quiet text", t.text_quiet}, Named{"accent", t.accent}, Named{"fault", t.fault},
          Named{"good", t.ok}, Named{"look at", t.warn}})
      add(text, ground);
  for (const Named& code :
       {Named{"keyword", t.keyword}, Named{"string", t.string}, Named{"number", t.number},
        Named{"comment", t.comment}, Named{"type", t.type}})
    add(code, grounds[3]);
  add({"text on accent", t.on_accent}, {"accent fill", t.accent_fill});
  add({"text", t.text}, {"fault ground", t.fault_ground});
  add({"fault", t.fault}, {"fault ground", t.fault_ground});
  add({"text", t.text}, {"good ground", t.ok_ground});
  QColor label_ground = t.label_ground;
  label_ground.setAlpha(255);
  add({"label", t.label}, {"label ground", label_ground});
  return out;
}

}  // namespace robomosp::viewer
