// SPDX-License-Identifier: Apache-2.0
// The page that the server gives to browsers, as texts; web_page_files.cpp is made of the files of
// remote/page, scene/replay and sdk/clients/javascript when the tree is built (layer: application,
// remote). Internal to modules/remote.
#pragma once

#include <string_view>

namespace robomosp::remote {

extern const std::string_view kWebPage;    ///< page.html, with @STYLE@ and @SCRIPT@
extern const std::string_view kWebStyle;   ///< style.css
extern const std::string_view kWebScript;  ///< all scripts, one after the other
extern const std::string_view kWebClient;  ///< robomosp.js

}  // namespace robomosp::remote
