// 200 x 200 x 20 mm with 100 holes of radius 6 mm; chords within 0.1 mm.
difference() {
  translate([-100, -100, 0]) cube([200, 200, 20]);
  for (i = [0:9], j = [0:9])
    translate([20 * (i - 4.5), 20 * (j - 4.5), -5]) cylinder(r = 6, h = 30, $fn = 18);
}
