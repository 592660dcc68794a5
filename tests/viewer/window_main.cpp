// SPDX-License-Identifier: GPL-3.0-or-later
// The main function of tests that drive the window.
#include <QApplication>

#include <gtest/gtest.h>

#include "viewer/theme/theme.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  qputenv("ROBOMOSP_NO_THUMBNAILS", "1");
  QApplication application(argc, argv);
  robomosp::viewer::set_theme(application, robomosp::viewer::make_theme(true));
  return RUN_ALL_TESTS();
}
