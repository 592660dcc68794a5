// SPDX-License-Identifier: GPL-3.0-or-later
// Hud: what is drawn over the picture in pixels: axes in the corner, labels, legends, caption
// (layer: GUI, private to scene/).
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <osg/Camera>
#include <osg/Geode>
#include <osg/MatrixTransform>
#include <osgText/Text>

#include "viewer/frame.h"
#include "viewer/scene/orbit_camera.h"

namespace robomosp::viewer {

/// Red, green and blue of the x, y and z axes, sRGB.
inline constexpr std::array<Colour, 3> kAxisColours{
    {{0.84F, 0.19F, 0.20F, 1}, {0.20F, 0.62F, 0.25F, 1}, {0.15F, 0.40F, 0.88F, 1}}};

/// Three arrows of unit length along the axes, for the surface program.
[[nodiscard]] osg::ref_ptr<osg::Group> axes_of(double shaft_radius);

class Hud {
 public:
  /// Number of the first render bin it may use.
  Hud(osg::Program* surface_program, int first_bin, unsigned mask);

  struct Label {
    Vec3 place{};  ///< [m]
    std::string text;
  };
  void set_caption(const std::string& text);
  void show_axes(bool on);
  void set_zoom(double zoom) { zoom_ = std::clamp(zoom, 0.5, 4.0); }  ///< of texts
  void set_dark(bool on);  ///< light texts, for a dark background
  void set_legends(std::vector<render::Legend> legends) { legends_ = std::move(legends); }
  /// Puts everything in its place for the next draw; `scale` is pixels per nominal pixel.
  void place(const OrbitCamera& camera, const std::vector<Label>& labels, double scale,
             double shift_x, double shift_y, bool is_linear);

  /// Of the last place(): labels drawn, and those without space.
  [[nodiscard]] std::size_t labels_shown() const { return labels_shown_; }
  [[nodiscard]] std::size_t labels_left_out() const { return labels_left_out_; }
  [[nodiscard]] osg::Node* node() { return root_.get(); }

 private:
  osg::ref_ptr<osgText::Text> new_text();
  /// The n-th of texts that come and go, made when it is needed first.
  osgText::Text& text_of(std::size_t n, const std::string& text);
  [[nodiscard]] static double width_of(const osgText::Text& text);
  std::size_t place_labels(const OrbitCamera& camera, const std::vector<Label>& labels,
                           double scale, bool is_linear);
  /// Bars and texts of all legends; returns the number of texts used, from `first` on.
  std::size_t place_legends(double width, double height, double scale, std::size_t first,
                            bool is_linear);
  void put(osgText::Text& text, double x, double y, double size, const Colour& colour,
           bool is_linear);

  osg::ref_ptr<osg::Group> root_ = new osg::Group;
  osg::ref_ptr<osg::Camera> arrows_ = new osg::Camera, texts_ = new osg::Camera;
  osg::ref_ptr<osg::MatrixTransform> corner_ = new osg::MatrixTransform;
  osg::ref_ptr<osg::Geode> text_node_ = new osg::Geode;
  std::array<osg::ref_ptr<osgText::Text>, 3> letters_;
  osg::ref_ptr<osgText::Text> caption_;
  std::vector<osg::ref_ptr<osgText::Text>> labels_;
  osg::ref_ptr<osg::Geode> bars_ = new osg::Geode, grounds_ = new osg::Geode;
  std::size_t labels_shown_ = 0, labels_left_out_ = 0;
  std::vector<render::Legend> legends_;
  bool has_axes_ = true;
  double zoom_ = 1;
  Colour ink_;
};

}  // namespace robomosp::viewer
