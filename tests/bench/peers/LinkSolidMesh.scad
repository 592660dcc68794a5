// Two hubs, a bar, two bores, twelve bolt holes; chords within 0.1 mm.
difference() {
  union() {
    cylinder(r = 60, h = 80, $fn = 55);
    translate([300, 0, 0]) cylinder(r = 45, h = 80, $fn = 48);
    translate([0, -30, 15]) cube([300, 60, 50]);
  }
  translate([0, 0, -10]) cylinder(r = 25, h = 100, $fn = 36);
  translate([300, 0, -10]) cylinder(r = 18, h = 100, $fn = 30);
  for (k = [0:5]) {
    translate([45 * cos(60 * k), 45 * sin(60 * k), 60]) cylinder(r = 4, h = 30, $fn = 15);
    translate([300 + 32 * cos(60 * k), 32 * sin(60 * k), 60]) cylinder(r = 4, h = 30, $fn = 15);
  }
}
