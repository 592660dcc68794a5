// A ball of radius 50 mm with three bores of radius 20 mm; chords within 0.1 mm.
difference() {
  sphere(r = 50, $fn = 50);
  for (turn = [[0, 0, 0], [0, 90, 0], [90, 0, 0]])
    rotate(turn) cylinder(r = 20, h = 120, center = true, $fn = 32);
}
