// SPDX-License-Identifier: GPL-3.0-or-later
// The outlines of all icons, drawn for the project: paths in the notation of SVG on a grid of 16
// units, with a line 1.3 units wide, or 2 where bold (layer: GUI).
#pragma once

#include <string_view>

namespace robomosp::viewer {

struct IconPath {
  std::string_view name, path;
  bool is_bold;
};

/// Sorted by name.
inline constexpr IconPath kIconPaths[] = {
    {"action", "M9 1.5L3.5 9H8l-1 5.5L12.5 7H8z", false},
    {"arrow", "M3 8h10M9.5 4.5L13 8l-3.5 3.5", false},
    {"box", "M3 5l5-2.5L13 5v6l-5 2.5L3 11zM3 5l5 2.5L13 5M8 7.5v6", false},
    {"camera", "M2 5h3l1.2-1.8h3.6L11 5h3v8H2zM8 6.5a2.3 2.3 0 110 4.6 2.3 2.3 0 010-4.6z", false},
    {"chevron_down", "M4 6l4 4 4-4", false},
    {"chevron_left", "M10 4L6 8l4 4", false},
    {"chevron_right", "M6 4l4 4-4 4", false},
    {"close", "M4.5 4.5l7 7M11.5 4.5l-7 7", false},
    {"console", "M2 3h12v10H2zM4.5 6l2 2-2 2M8.5 10.5h3", false},
    {"copy", "M5.5 5.5h8v8h-8zM10.5 5.5v-3h-8v8h3", false},
    {"cursor", "M4 2l8.5 6-4 .8L6 13z", false},
    {"cylinder",
     "M4 4.5C4 3.4 5.8 2.5 8 2.5s4 .9 4 2v7c0 1.1-1.8 2-4 2s-4-.9-4-2zM4 4.5c0 1.1 1.8 2 4"
     " 2s4-.9 4-2",
     false},
    {"dark", "M13 9.5A5.5 5.5 0 016.5 3 5.5 5.5 0 1013 9.5z", false},
    {"difference", "M6 3a4 4 0 100 8 4 4 0 000-8zM10.5 5a4 4 0 11-4 6.5", false},
    {"drag", "M6 4h.01M10 4h.01M6 8h.01M10 8h.01M6 12h.01M10 12h.01", true},
    {"edge", "M3 13L3 5l5-2.5L13 5v8", false},
    {"external", "M6.5 3.5h-4v10h10v-4M9 2.5h4.5V7M13.5 2.5L7.5 8.5", false},
    {"eye",
     "M1.5 8S4 3.5 8 3.5 14.5 8 14.5 8 12 12.5 8 12.5 1.5 8 1.5 8zM8 6.2a1.8 1.8 0 110 3.6"
     " 1.8 1.8 0 010-3.6z",
     false},
    {"fault", "M8 2a6 6 0 110 12A6 6 0 018 2zM8 5v3.8M8 11v.01", false},
    {"fillet", "M2.5 2.5H6v3a4.5 4.5 0 004.5 4.5h3v3.5h-11z", false},
    {"filter", "M2.5 4h11M4.5 8h7M6.5 12h3", false},
    {"fit", "M2.5 5.5v-3h3M10.5 2.5h3v3M13.5 10.5v3h-3M5.5 13.5h-3v-3M6 6h4v4H6z", false},
    {"folder", "M1.5 4h4.5l1.5 2h7v7h-13z", false},
    {"four_views", "M2.5 2.5h11v11h-11zM8 2.5v11M2.5 8h11", false},
    {"frame", "M4 12V3M4 12h9M4 12l4-4M2.8 4.5L4 3l1.2 1.5M11.5 10.8L13 12l-1.5 1.2", false},
    {"gauge", "M2.5 11.5a5.5 5.5 0 1111 0M8 11.5l2.5-4", false},
    {"grid", "M2.5 2.5h11v11h-11zM2.5 6.2h11M2.5 9.8h11M6.2 2.5v11M9.8 2.5v11", false},
    {"grip", "M4 3v6l2 2v3M12 3v6l-2 2v3M4 9h8", false},
    {"group", "M2.5 4.5V2.5h2M11.5 2.5h2v2M13.5 11.5v2h-2M4.5 13.5h-2v-2M5.5 5.5h5v5h-5z", false},
    {"hand",
     "M5 8V4a1 1 0 012 0v3-4.5a1 1 0 012 0V7 4a1 1 0 012 0v6c0 2.5-1.5 4-4 4s-3-1.5-4.5-4."
     "5c-.5-1 .8-1.8 1.5-1z",
     false},
    {"hidden",
     "M2 2l12 12M6.2 4.2A6 6 0 018 3.5c4 0 6.5 4.5 6.5 4.5a11 11 0 01-2 2.5M10 11.9A6 6 0 "
     "018 12.5C4 12.5 1.5 8 1.5 8a11 11 0 012.4-2.9",
     false},
    {"home", "M2.5 7.5L8 3l5.5 4.5M4 6.5v7h8v-7", false},
    {"info", "M8 2a6 6 0 110 12A6 6 0 018 2zM8 7.3v3.7M8 5v.01", false},
    {"isometric", "M8 1.8l5.5 3v6.4L8 14.2l-5.5-3V4.8zM2.5 4.8L8 8l5.5-3.2M8 8v6.2", false},
    {"jobs", "M8 2a6 6 0 110 12A6 6 0 018 2zM8 4.5V8l2.5 1.5", false},
    {"joint", "M8 4.5a3.5 3.5 0 110 7 3.5 3.5 0 010-7zM8 8h.01M8 1.5v3M8 11.5v3", false},
    {"keyboard", "M1.5 4h13v8h-13zM4 6.5h.01M7 6.5h.01M10 6.5h.01M12 6.5h.01M5 9.5h6", false},
    {"layers", "M8 2.5l6 3-6 3-6-3zM2 8.5l6 3 6-3", false},
    {"library", "M3 2.5v11M6 2.5v11M9 3l3 10.3M2 13.5h12", false},
    {"light", "M8 1.5a4.5 4.5 0 00-2.5 8.2V11.5h5V9.7A4.5 4.5 0 008 1.5zM6 13.7h4", false},
    {"link",
     "M2.9 9.9l7-7a2.2 2.2 0 013.2 3.2l-7 7a2.2 2.2 0 01-3.2-3.2zM4.5 11.5h.01M11.5 4.5h.01",
     false},
    {"list", "M5.5 4h8M5.5 8h8M5.5 12h8M2.5 4h.01M2.5 8h.01M2.5 12h.01", false},
    {"loop",
     "M11 2l2.5 2.5L11 7M13.5 4.5H5A2.5 2.5 0 002.5 7v1M5 14l-2.5-2.5L5 9M2.5 11.5H11A2.5 "
     "2.5 0 0013.5 9V8",
     false},
    {"material", "M8 2.5a5.5 5.5 0 110 11 5.5 5.5 0 010-11zM5.5 6.5A3 3 0 018 5", false},
    {"matrix", "M4.5 2.5h-2v11h2M11.5 2.5h2v11h-2M6 6h.01M10 6h.01M6 10h.01M10 10h.01", false},
    {"measure", "M2 10.5L10.5 2 14 5.5 5.5 14zM5 7.5L6.5 9M7.5 5L9 6.5M10 2.5", false},
    {"messages", "M2 3h12v8H7l-3 3v-3H2z", false},
    {"minus", "M3.5 8h9", false},
    {"more", "M3.5 8h.01M8 8h.01M12.5 8h.01", true},
    {"move",
     "M8 1.8v12.4M1.8 8h12.4M6.3 3.5L8 1.8l1.7 1.7M6.3 12.5L8 14.2l1.7-1.7M3.5 6.3L1.8 8l1"
     ".7 1.7M12.5 6.3L14.2 8l-1.7 1.7",
     false},
    {"node", "M4 3.5h8v3.5H4zM8 7v2M4 9h8v3.5H4z", false},
    {"object", "M8 1.8l5.5 3v6.4L8 14.2l-5.5-3V4.8zM2.5 4.8L8 8l5.5-3.2M8 8v6.2", false},
    {"ok", "M3 8.5l3.2 3.2L13 5", false},
    {"panel_left", "M2 3h12v10H2zM6 3v10", false},
    {"paste", "M5.5 3.5h-2v10h9v-10h-2M5.5 2.5h5V5h-5z", false},
    {"pattern", "M8 2.5v.01M12.5 5v.01M12.5 11v.01M8 13.5v.01M3.5 11v.01M3.5 5v.01M8 8h.01", true},
    {"pause", "M5 3v10M11 3v10", false},
    {"perspective", "M5 3h6l2.5 10.5h-11zM4 8h8M8 3v10.5", false},
    {"pin", "M8 9.5V14M5 9.5h6L10 7V3.5h.8V2H5.2v1.5H6V7z", false},
    {"play", "M4.5 2.8l8.5 5.2-8.5 5.2z", false},
    {"plot", "M2.5 2.5v11h11M4.5 10.5l3-4 2.5 2 3.5-5", false},
    {"plus", "M8 3.5v9M3.5 8h9", false},
    {"program", "M3.5 1.5h6l3 3v10h-9zM6.5 7.5L5 9l1.5 1.5M9.5 7.5L11 9l-1.5 1.5", false},
    {"record_macro",
     "M8 2.5a5.5 5.5 0 110 11 5.5 5.5 0 010-11zM8 5.5a2.5 2.5 0 110 5 2.5 2.5 0 010-5zM8 7"
     "a1 1 0 110 2 1 1 0 010-2z",
     false},
    {"recording", "M8 3a5 5 0 110 10A5 5 0 018 3zM8 6.5a1.5 1.5 0 110 3 1.5 1.5 0 010-3z", false},
    {"redo", "M10 3l3 3-3 3M13 6H6.5a3.5 3.5 0 000 7H10", false},
    {"refresh", "M13 8a5 5 0 11-1.5-3.6M13 2.5V5h-2.5", false},
    {"rename", "M3 13l.6-2.8L10.8 3l2.2 2.2-7.2 7.2zM9.3 4.5l2.2 2.2M8 13.5h5.5", false},
    {"repeat_block", "M4 4h8v8H4M6.5 9.5L4 12l2.5 2.5", false},
    {"robot",
     "M3 14h6M6 14v-3.5M6 10.5L4.5 5.5M4.5 5.5L10.5 3.5M10.5 3.5L13 7M11.8 8.5L13 7l1.4 1."
     "1M4.5 4.2a1.3 1.3 0 110 2.6 1.3 1.3 0 010-2.6z",
     false},
    {"rotate", "M13 8a5 5 0 11-1.6-3.7M13 2v3h-3", false},
    {"run", "M5 3.5l8 4.5-8 4.5z", false},
    {"save", "M2.5 2.5h9l2 2v9h-11zM5 2.5v4h5v-4M5 13.5v-4h6v4", false},
    {"search", "M7 2.5a4.5 4.5 0 110 9 4.5 4.5 0 010-9zM10.5 10.5L14 14", false},
    {"section",
     "M2.5 4.5h7v9h-7zM2.5 9l4.5-4.5M2.5 13l7-7M6.2 13.5l3.3-3.3M12.5 2v1.5M12.5 5.5v1.8M12.5 "
     "9.3v1.8M12.5 13v1",
     false},
    {"segment_arc",
     "M3 12A7 7 0 0113 5M1.8 12.5a1.2 1.2 0 102.4 0 1.2 1.2 0 00-2.4 0M11.8 4.5a1.2 1.2 0 "
     "102.4 0 1.2 1.2 0 00-2.4 0",
     false},
    {"segment_circle", "M8 2.5a5.5 5.5 0 110 11 5.5 5.5 0 010-11z", false},
    {"segment_line",
     "M3 12.5L13 3.5M1.8 12.5a1.2 1.2 0 102.4 0 1.2 1.2 0 00-2.4 0M11.8 3.5a1.2 1.2 0 102."
     "4 0 1.2 1.2 0 00-2.4 0",
     false},
    {"server", "M2.5 3h11v4h-11zM2.5 9h11v4h-11zM5 5h.01M5 11h.01", false},
    {"set_signal", "M2 12h4V4h4v8h4", false},
    {"shading", "M8 2.5a5.5 5.5 0 110 11 5.5 5.5 0 010-11zM8 2.5v11M10 3.5v9M12 5v6", false},
    {"signal", "M1.5 11h3V5h4v6h3V5h3", false},
    {"snap", "M3.5 2.5v6a4.5 4.5 0 009 0v-6h-3v6a1.5 1.5 0 01-3 0v-6zM3.5 5h3M9.5 5h3", false},
    {"solid",
     "M3 4.5C3 3.1 5.2 2 8 2s5 1.1 5 2.5v7C13 12.9 10.8 14 8 14s-5-1.1-5-2.5zM3 4.5C3 5.9 "
     "5.2 7 8 7s5-1.1 5-2.5",
     false},
    {"step_back", "M11 3.5L5 8l6 4.5zM3.5 3.5v9", false},
    {"step_forward", "M5 3.5L11 8l-6 4.5zM12.5 3.5v9", false},
    {"step_into", "M8 2v7M5 6.5L8 9.5l3-3M8 12.5v1", false},
    {"step_out", "M8 10V3M5 6l3-3 3 3M8 12.5v1", false},
    {"step_over", "M2.5 9A5.5 5.5 0 0113 7.5M13.5 3.5v4h-4M8 12.5v1", false},
    {"stop", "M4 4h8v8H4z", false},
    {"sun",
     "M8 5a3 3 0 110 6 3 3 0 010-6zM8 1.5v1.5M8 13v1.5M1.5 8H3M13 8h1.5M3.4 3.4l1.1 1.1M11"
     ".5 11.5l1.1 1.1M3.4 12.6l1.1-1.1M11.5 4.5l1.1-1.1",
     false},
    {"target", "M8 3a5 5 0 110 10A5 5 0 018 3zM8 1v4M8 11v4M1 8h4M11 8h4", false},
    {"task", "M2.5 3.5h6v3h-6zM2.5 9.5h6v3h-6zM8.5 5h3v6h-3M11.5 8h2", false},
    {"tool", "M5.5 2.5h5v3h-5zM8 5.5v2M3.5 7.5h9M3.5 7.5v4L5.5 14M12.5 7.5v4l-2 2.5", false},
    {"trajectory",
     "M2.5 13C5 13 4 4 8 4s3 8 5.5 3.5M2.5 11.8a1.2 1.2 0 110 2.4 1.2 1.2 0 010-2.4zM13.5 "
     "5.3a1.2 1.2 0 110 2.4 1.2 1.2 0 010-2.4z",
     false},
    {"trash", "M3 4.5h10M6 4.5V2.5h4v2M4.2 4.5l.6 9h6.4l.6-9M6.7 7v4.2M9.3 7v4.2", false},
    {"undo", "M6 3L3 6l3 3M3 6h6.5a3.5 3.5 0 010 7H6", false},
    {"union", "M6 3a4 4 0 012.9 1.3A4 4 0 1110.5 13 4 4 0 017 11 4 4 0 116 3z", false},
    {"wait", "M8 2a6 6 0 110 12A6 6 0 018 2zM8 5v3l2 1.5", false},
    {"warning", "M8 2l6.5 11.5h-13zM8 6v3.5M8 11.5v.01", false},
    {"wireframe",
     "M8 2.5a5.5 5.5 0 110 11 5.5 5.5 0 010-11zM2.5 8h11M8 2.5c3 3 3 8 0 11M8 2.5c-3 3-3 8"
     " 0 11",
     false},
    {"world", "M8 2a6 6 0 110 12A6 6 0 018 2zM2 8h12M8 2c2.2 2 2.2 10 0 12M8 2c-2.2 2-2.2 10 0 12",
     false},
};

}  // namespace robomosp::viewer
