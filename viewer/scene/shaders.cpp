// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/shaders.h"

namespace robomosp::viewer {
namespace {

// Irradiances are divided by pi, so that a white surface under a lamp alone shows its colour.
constexpr const char* kCommon = R"glsl(
uniform vec4 eye;             // place, w = 1; or direction towards the eye, w = 0
uniform int lamp_count;
uniform vec4 lamp_place[8];   // place, w = 1; or direction towards the lamp, w = 0
uniform vec4 lamp_axis[8];    // where a spot shines; w = cosine of half its opening, -2 = all sides
uniform vec3 lamp_colour[8];
uniform vec3 surroundings;    // share of the light of the studio's sky and floor
uniform float dark;           // 1 = a studio with dark floor and wall
uniform vec3 sky_direction;
uniform mat4 lamp_map, sky_map;             // world to texture coordinates and depth 0..1
uniform sampler2DShadow lamp_shadow, sky_shadow;
uniform vec2 lamp_texel, sky_texel;         // x: in texture, y: in the world [m]
#ifdef SKY
// A pass of a good still has each twice: another point of the lamp, another direction of the sky.
uniform mat4 lamp_map_2, sky_map_2;
uniform sampler2DShadow lamp_shadow_2, sky_shadow_2;
uniform vec2 sky_texel_2;
uniform vec3 sky_direction_2;
#endif
uniform vec3 ray_centre, ray_right, ray_up; // view rays over the picture, -1..1
const vec3 kSky = vec3(0.440, 0.470, 0.520);
const vec3 kBounce = vec3(0.200, 0.190, 0.178);

// Linear to sRGB from square roots, which software OpenGL computes much faster than powers; within
// 0.002 of the exact curve (I. Taylor, "sRGB approximations for HLSL", 2012).
vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  vec3 s1 = sqrt(c), s2 = sqrt(s1), s3 = sqrt(s2);
  return 0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * c;
}
// Shoulder of the Khronos PBR Neutral tone mapper: colours below 0.76 stay as they are.
vec3 toned(vec3 c) {
  float peak = max(c.r, max(c.g, c.b));
  if (peak < 0.76) return c;
  float squeezed = 1.0 - 0.24 * 0.24 / (peak + 0.24 - 0.76);
  return mix(c * (squeezed / peak), vec3(squeezed), 1.0 - 1.0 / (0.15 * (peak - squeezed) + 1.0));
}
#ifdef STILL
// Linear light, averaged and developed later; but drawings as the eye sees them, so that the mean of
// a line and the paper lies half way.
uniform float drawn;
vec3 shown(vec3 c) { return drawn > 0.5 ? encoded(c) : c; }
#else
vec3 shown(vec3 c) { return encoded(toned(c)); }
#endif

// What lies behind everything: a studio wall, seen along a ray that rises with the sine `rise`.
vec3 backdrop(float rise) {
  vec3 low = vec3(0.474, 0.482, 0.496), haze = vec3(0.720, 0.742, 0.768), top = vec3(0.468, 0.540, 0.632);
  low = mix(low, vec3(0.0255, 0.0300, 0.0370), dark);
  haze = mix(haze, vec3(0.0470, 0.0578, 0.0720), dark);
  top = mix(top, vec3(0.0185, 0.0225, 0.0290), dark);
  vec3 c = mix(low, haze, smoothstep(-0.42, -0.06, rise));
  return mix(c, top, smoothstep(-0.06, 0.34, rise)) * surroundings;
}
vec3 ray_at(vec2 screen) { return normalize(ray_centre + screen.x * ray_right + screen.y * ray_up); }

// Interleaved gradient noise (J. Jimenez, "Next generation post processing in Call of Duty", 2014).
float noise(vec2 at) { return fract(52.9829189 * fract(dot(at, vec2(0.06711056, 0.00583715)))); }
float lit(sampler2DShadow map, vec3 c) {
  // What lies behind the farthest caster may still be in its shadow; beside the map nothing casts.
  c.z = min(c.z, 0.9999);
  if (any(lessThan(c.xy, vec2(0.0))) || any(greaterThan(c.xy, vec2(1.0)))) return 1.0;
  return texture(map, c);
}
// Direction from p towards a lamp, and in w the share of its light that it sends there.
vec4 lamp_from(int i, vec3 p) {
#ifdef OWN_LAMP
  return vec4(lamp_place[i].xyz, 1.0);
#endif
  vec3 l = normalize(lamp_place[i].xyz - p * lamp_place[i].w);
  float edge = lamp_axis[i].w;
  float share = edge < -1.5 ? 1.0 : smoothstep(edge, mix(edge, 1.0, 0.2), -dot(l, lamp_axis[i].xyz));
  return vec4(l, share);
}
// Of the first lamp, which is the one with a shadow map. `lift` [texels] moves what casts shadows
// itself off its own; the floor casts none.
float lamp_visibility(vec3 p, vec3 n, vec3 l, float lift) {
  float slope = 1.0 - max(dot(n, l), 0.0);
  vec4 at = vec4(p + n * lamp_texel.y * lift * (0.8 + 2.2 * slope), 1.0);
  vec4 h = lamp_map * at;
  if (h.w <= 0.0) return 1.0;  // behind it
  vec3 c = h.xyz / h.w;
  // Software OpenGL runs both sides of every branch, hence compile-time choices. One tap is enough
  // where many pictures with different lamps are averaged.
#if defined(QUALITY) && !defined(STILL)
  // A disk by the golden angle. Turned by noise from pixel to pixel, its shadows would be stippled.
  float sum = 0.0;
  for (int i = 0; i < 16; ++i) {
    float a = 2.3999632 * float(i), r = sqrt((float(i) + 0.5) / 16.0) * 3.0;
    sum += lit(lamp_shadow, vec3(c.xy + vec2(cos(a), sin(a)) * r * lamp_texel.x, c.z));
  }
  return sum / 16.0;
#elif defined(SKY)
  vec4 h2 = lamp_map_2 * at;
  return 0.5 * (lit(lamp_shadow, c) + lit(lamp_shadow_2, h2.xyz / h2.w));
#else
  return lit(lamp_shadow, c);
#endif
}
#ifdef SKY
// Each direction of the sky would cast a shadow with a hard edge, and those of the few directions of
// a picture would show as patches. Four lookups around the place, in the plane of the surface, which
// therefore does not shade itself, soften them; every direction turns the four by its own angle.
float sky_seen(sampler2DShadow map, mat4 map_T_world, vec3 towards, float texel, vec3 p, vec3 n,
               float lift) {
  float up = max(dot(n, towards), 0.0);
  vec3 c = (map_T_world * vec4(p + n * texel * lift * (4.0 - 2.8 * up), 1.0)).xyz;
  vec3 t = normalize(abs(n.z) < 0.7 ? vec3(-n.y, n.x, 0.0) : vec3(0.0, -n.z, n.y));
  float angle = 40.0 * (towards.x + 2.0 * towards.y);
  vec3 along = (cos(angle) * t + sin(angle) * cross(n, t)) * (texel * 6.0);
  vec3 a = mat3(map_T_world) * along, b = mat3(map_T_world) * cross(n, along);
  return 0.25 * up * (lit(map, c + a) + lit(map, c + 0.7 * b) + lit(map, c - 0.85 * a) + lit(map, c - 0.5 * b));
}
// Light from the sky on a place, 1 = from half the sphere evenly onto a free one.
float sky_light(vec3 p, vec3 n, float lift) {
  return sky_seen(sky_shadow, sky_map, sky_direction, sky_texel.y, p, n, lift) +
         sky_seen(sky_shadow_2, sky_map_2, sky_direction_2, sky_texel_2.y, p, n, lift);
}
#endif
)glsl";

constexpr const char* kWorldVertex = R"glsl(#version 130
uniform mat4 world_T_view;
uniform vec4 section_plane;  // what is on its negative side is cut away where that is switched on
out vec3 p_world, n_world;
void main() {
  vec4 v = gl_ModelViewMatrix * gl_Vertex;
  p_world = (world_T_view * v).xyz;
  gl_ClipDistance[0] = dot(section_plane, vec4(p_world, 1.0));
  n_world = mat3(world_T_view) * (gl_NormalMatrix * gl_Normal);
  gl_Position = gl_ProjectionMatrix * v;
}
)glsl";

constexpr const char* kSurfaceFragment = R"glsl(
in vec3 p_world, n_world;
uniform vec4 base;       // linear colour, opacity
uniform vec4 surface;    // roughness, metalness, unused, unused
uniform vec3 shade;      // linear colour under ambient light
uniform vec4 highlight;  // linear colour of highlights; w = 1 if given
uniform vec3 glow;       // linear light of its own

#ifdef QUALITY
// A studio: floor below, bright ceiling, one tall light panel behind the scene and one beside it.
vec3 studio(vec3 r, float rough) {
  float soft = 0.06 + 0.9 * rough;
  vec3 c = mix(vec3(0.25, 0.247, 0.245), vec3(0.54, 0.585, 0.65), smoothstep(-soft, soft, r.z));
  vec2 d = normalize(r.xy + 1e-4);
  float low = smoothstep(-1.0, 0.15, r.z) * smoothstep(1.0, 0.6, abs(r.z));
  float back = smoothstep(0.72 - soft, 0.93, dot(d, vec2(-0.75, 0.66)));
  float side = smoothstep(0.80 - soft, 0.97, dot(d, vec2(0.97, 0.23)));
  float front = smoothstep(0.88 - soft, 0.99, dot(d, vec2(-0.20, -0.98)));
  return c + low * (vec3(0.85, 0.90, 1.0) * back * 0.60 + vec3(1.0, 0.97, 0.93) * (side * 0.55 + front * 0.65)) / (1.0 + 1.5 * rough);
}
#endif

void main() {
  vec3 v = normalize(eye.xyz - p_world * eye.w);
#ifdef FLAT
  vec3 n = normalize(cross(dFdx(p_world), dFdy(p_world)));
#else
  vec3 n = normalize(n_world);
#endif
  if (dot(n, v) < 0.0) n = -n;
  float nv = max(dot(n, v), 0.02);
  float rough = surface.x, metal = surface.y;
  vec3 direct = vec3(0.0), specular = vec3(0.0);
#ifdef QUALITY
  vec3 f0 = mix(0.04 * highlight.rgb, mix(base.rgb, highlight.rgb, highlight.w), metal);
  float k = (rough + 1.0) * (rough + 1.0) / 8.0;
#else
  vec3 glossy = mix(highlight.rgb, mix(base.rgb, highlight.rgb, highlight.w), metal);
#endif
  for (int i = 0; i < LAMPS; ++i) {
    vec4 from = lamp_from(i, p_world);
    float nl = max(dot(n, from.xyz), 0.0);
    vec3 light = lamp_colour[i] * (nl * from.w);
    if (i == 0) light *= lamp_visibility(p_world, n, from.xyz, 1.0);
    direct += light;
    vec3 h = normalize(v + from.xyz);
    float nh = max(dot(n, h), 0.0);
#ifdef QUALITY
    float a2 = rough * rough * rough * rough, d = nh * nh * (a2 - 1.0) + 1.0;
    float visible = 1.0 / (4.0 * (nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
    float away = 1.0 - max(dot(h, v), 0.0), away2 = away * away;
    vec3 fresnel = f0 + (1.0 - f0) * (away2 * away2 * away);
    specular += min(a2 / (d * d) * visible, 24.0) * fresnel * light;
#else
    specular += glossy * light * (pow(nh, mix(160.0, 10.0, rough)) * mix(0.55, 0.06, rough));
#endif
  }

  float open = 1.0;      // how much of the sky this place sees, relative to a free one
  vec3 sky = kSky * (0.5 + 0.5 * n.z);
#ifdef SKY
  float seen = sky_light(p_world, n, 1.0);
  sky = kSky * seen;
  open = seen * 2.0 / (1.0 + max(n.z, -0.5));
#endif
  vec3 ambient = sky + kBounce * (0.5 - 0.5 * n.z) + 0.09 * max(dot(n, vec3(-0.55, 0.75, 0.37)), 0.0);
  ambient *= surroundings;
  vec3 diffuse = (1.0 - metal) * (base.rgb * direct + shade * ambient);
  if (base.a < 0.999) diffuse = mix(diffuse, base.rgb, 0.7);  // clear bodies glow rather than shade
#ifdef QUALITY
  // Split-sum fit of the environment term: B. Karis, "Physically based shading on mobile", 2014.
  vec4 r4 = rough * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float fit = min(r4.x * r4.x, exp2(-9.28 * nv)) * r4.x + r4.y;
  vec2 ab = vec2(-1.04, 1.04) * fit + r4.zw;
  specular += studio(reflect(-v, n), rough) * (f0 * ab.x + ab.y) * (0.35 + 0.65 * open) * surroundings;
#else
  specular += base.rgb * metal * (direct * 0.4 + ambient * 0.9) + surroundings * 0.05 * (1.0 - nv) * (1.0 - nv) * (1.0 - nv);
#endif
  float rim = (1.0 - nv) * (1.0 - nv);
  vec3 c = diffuse + specular + glow;
  c *= 1.0 - 0.15 * dark;  // 93 % of the brightness as seen, so that white bodies do not glare
  float alpha = base.a;
  if (alpha < 0.999) alpha = clamp(alpha + 0.5 * rim * (1.0 - alpha) + 0.6 * max(specular.g - 0.1, 0.0), 0.0, 1.0);
  gl_FragColor = vec4(shown(c), alpha);
}
)glsl";

constexpr const char* kGroundFragment = R"glsl(
in vec3 p_world, n_world;
uniform vec4 ground;      // x, y of the scene's centre, fade begin and end [m]
uniform float floor_lamp;  // cosine of the renderer's own lamp on the floor
const vec3 kOwnLamp = vec3(1.02, 0.985, 0.93) * 0.86;
uniform vec4 grid;        // small step [m], large step [m], lines on, axes on
uniform float line_scale; // width of a thin line [px]
uniform vec2 viewport, origin;    // [px]

// Coverage of the pixel by lines of spacing `step`, fading out where they come too close.
float lines(vec2 p, float step, float width) {
  vec2 c = p / step, per_pixel = sqrt(dFdx(c) * dFdx(c) + dFdy(c) * dFdy(c)) + 1e-9;
  vec2 away = abs(fract(c - 0.5) - 0.5) / per_pixel;
  vec2 cover = clamp(0.5 * width + 0.5 - away, 0.0, 1.0) * (1.0 - smoothstep(0.10, 0.40, per_pixel));
  return max(cover.x, cover.y);
}
vec2 axes(vec2 p, float width) {
  vec2 per_pixel = sqrt(dFdx(p) * dFdx(p) + dFdy(p) * dFdy(p)) + 1e-9;
  return clamp(0.5 * width + 0.5 - abs(p) / per_pixel, 0.0, 1.0);
}

void main() {
  bool from_below = eye.w > 0.5 ? eye.z < p_world.z : eye.z < 0.0;
  vec3 n = vec3(0.0, 0.0, 1.0);
  vec3 direct = vec3(0.0);
  for (int i = 0; i < LAMPS; ++i) {
    vec4 from = lamp_from(i, p_world);
    vec3 light = lamp_colour[i] * (max(from.z, 0.0) * from.w);
    if (i == 0) light *= lamp_visibility(p_world, n, from.xyz, 0.0);
    direct += light;
  }
  vec3 sky = kSky;
#ifdef SKY
  sky = kSky * sky_light(p_world, n, 0.0);
#endif
  vec3 received = (direct + surroundings * sky) / (kOwnLamp * floor_lamp + kSky);
  float far = length(p_world.xy - ground.xy);
  float fade = smoothstep(ground.z, ground.w, far);
  vec3 c = mix(vec3(0.503, 0.509, 0.520), vec3(0.0273, 0.0319, 0.0395), dark);
  float thin = lines(p_world.xy, grid.x, line_scale) * 0.26 * (1.0 - smoothstep(0.25 * ground.z, 1.6 * ground.z, far));
  float thick = lines(p_world.xy, grid.y, 1.5 * line_scale) * 0.50;
  float cover = max(thin, thick) * grid.z;
  c = mix(c, mix(vec3(0.155, 0.165, 0.185), vec3(0.0085, 0.0100, 0.0125), dark), cover);
  vec2 axis = axes(p_world.yx, 2.2 * line_scale) * grid.w;
  float dimmed = 1.0 - 0.72 * dark;
  c = mix(c, vec3(0.60, 0.050, 0.060) * dimmed, axis.x * 0.9);
  c = mix(c, vec3(0.070, 0.36, 0.075) * dimmed, axis.y * 0.9);
  c = mix(from_below ? c : c * received, backdrop(ray_at((gl_FragCoord.xy - origin) / viewport * 2.0 - 1.0).z), fade);
  float alpha = from_below ? 0.6 * max(cover, max(axis.x, axis.y)) * (1.0 - fade) : 1.0;
  gl_FragColor = vec4(shown(c), alpha);
}
)glsl";

std::string header(ShaderVariant v) {
  std::string s = "#version 130\n";
  if (v.is_quality) s += "#define QUALITY 1\n";
  // A pass of a still has one lamp.
  if (v.is_still) s += "#define STILL 1\n";
  const int lamps = v.is_still ? 1 : v.lamps;
  s += "#define LAMPS " + (lamps > 0 ? std::to_string(lamps) : std::string("lamp_count")) + "\n";
  if (v.has_own_lamp) s += "#define OWN_LAMP 1\n";
  if (v.is_flat) s += "#define FLAT 1\n";
  if (v.is_still && v.is_quality)
    s += "#define SKY 1\n";  // ambient light from one direction a pass
  return s;
}

std::string with_light(ShaderVariant v, const char* body) { return header(v) + kCommon + body; }

}  // namespace

ShaderPair surface_shader(ShaderVariant v) {
  return {kWorldVertex, with_light(v, kSurfaceFragment)};
}

ShaderPair ground_shader(ShaderVariant v) { return {kWorldVertex, with_light(v, kGroundFragment)}; }

ShaderPair background_shader(ShaderVariant v) {
  return {R"glsl(#version 130
out vec2 screen;
void main() {
  screen = gl_Vertex.xy;
  gl_Position = vec4(gl_Vertex.xy, 1.0, 1.0);  // at the far end of the depth range
}
)glsl",
          with_light(v, R"glsl(
in vec2 screen;
void main() {
  // Half a grey level of noise keeps eight bits from showing bands.
  gl_FragColor = vec4(shown(backdrop(ray_at(screen).z)) + (noise(gl_FragCoord.xy) - 0.5) / 255.0, 1.0);
}
)glsl")};
}

ShaderPair edge_shader(ShaderVariant v) {
  return {R"glsl(#version 130
uniform mat4 world_T_view;
uniform vec4 section_plane;
out float along;  // [m] from the start of the line
void main() {
  vec4 v = gl_ModelViewMatrix * gl_Vertex;
  gl_ClipDistance[0] = dot(section_plane, vec4((world_T_view * v).xyz, 1.0));
  along = gl_MultiTexCoord0.x;
  gl_Position = gl_ProjectionMatrix * v;
  gl_Position.z -= 0.00004 * gl_Position.w;
}
)glsl",
          with_light(v, R"glsl(
in float along;
uniform vec4 edge_colour;  // linear
uniform float dash;        // length of a dash and its gap [m]; 0 = a whole line
void main() {
  if (dash > 0.0 && fract(along / dash) > 0.58) discard;
  gl_FragColor = vec4(shown(edge_colour.rgb), edge_colour.a);
}
)glsl")};
}

// gl_Normal holds the point before, gl_MultiTexCoord0 the point after and, in w, the side.
ShaderPair ribbon_shader(ShaderVariant v) {
  return {R"glsl(#version 130
uniform vec2 viewport;      // [px]
uniform float line_scale;
uniform float ribbon_width; // [px]
out float across;           // [px] from the middle
out float half_width;
vec2 pixel(vec4 clip) { return clip.xy / max(clip.w, 1e-6) * viewport * 0.5; }
void main() {
  vec4 here = gl_ModelViewProjectionMatrix * gl_Vertex;
  vec2 p = pixel(here);
  vec2 before = p - pixel(gl_ModelViewProjectionMatrix * vec4(gl_Normal, 1.0));
  vec2 after = pixel(gl_ModelViewProjectionMatrix * vec4(gl_MultiTexCoord0.xyz, 1.0)) - p;
  float lb = length(before), la = length(after);
  vec2 d1 = lb > 1e-4 ? before / lb : (la > 1e-4 ? after / la : vec2(1.0, 0.0));
  vec2 d2 = la > 1e-4 ? after / la : d1;
  vec2 sum = d1 + d2;
  vec2 along = length(sum) > 0.2 ? normalize(sum) : d1;
  vec2 normal = vec2(-along.y, along.x);
  float mitre = 1.0 / max(dot(normal, vec2(-d1.y, d1.x)), 0.5);
  half_width = 0.5 * ribbon_width * line_scale;
  across = gl_MultiTexCoord0.w * (half_width + 1.0);
  here.xy += normal * mitre * across / (viewport * 0.5) * here.w;
  here.z -= 0.0001 * here.w;
  gl_Position = here;
}
)glsl",
          with_light(v, R"glsl(
in float across;
in float half_width;
uniform vec4 base;          // linear
uniform float veil;         // opacity of this draw: 1 in view, less where hidden
void main() {
  float cover = clamp(half_width + 0.5 - abs(across), 0.0, 1.0);
  float edge = abs(across) / half_width;
  vec3 c = base.rgb * (1.06 - 0.30 * edge * edge);   // a little roundness
  gl_FragColor = vec4(shown(c), base.a * veil * cover);
}
)glsl")};
}

ShaderPair outline_shader(ShaderVariant v) {
  return {R"glsl(#version 130
uniform vec2 viewport;
uniform float line_scale;
uniform mat4 world_T_view;
uniform vec4 section_plane;
void main() {
  gl_ClipDistance[0] =
      dot(section_plane, vec4((world_T_view * (gl_ModelViewMatrix * gl_Vertex)).xyz, 1.0));
  vec4 here = gl_ModelViewProjectionMatrix * gl_Vertex;
  vec2 n = (gl_ProjectionMatrix * vec4(gl_NormalMatrix * gl_Normal, 0.0)).xy * viewport;
  float l = length(n);
  if (l > 1e-6) here.xy += n / l * 2.6 * line_scale / (viewport * 0.5) * here.w;
  // The floor right in front of a body shall not hide its outline.
  here.z -= 0.0006 * here.w;
  gl_Position = here;
}
)glsl",
          with_light(v, R"glsl(
uniform vec4 accent;    // linear
uniform float veil;     // opacity of this draw: 1 in view, less where hidden
void main() { gl_FragColor = vec4(shown(accent.rgb), veil); }
)glsl")};
}

ShaderPair caster_shader() {
  return {R"glsl(#version 130
uniform mat4 world_T_view;
uniform vec4 section_plane;
void main() {
  vec4 v = gl_ModelViewMatrix * gl_Vertex;
  gl_ClipDistance[0] = dot(section_plane, vec4((world_T_view * v).xyz, 1.0));
  gl_Position = gl_ProjectionMatrix * v;
}
)glsl",
          "#version 130\nvoid main() { gl_FragColor = vec4(1.0); }\n"};
}

ShaderPair paper_shader(ShaderVariant v) {
  return {kWorldVertex, with_light(v, R"glsl(
in vec3 p_world, n_world;
uniform vec4 base;  // linear
void main() { gl_FragColor = vec4(shown(base.rgb), base.a); }
)glsl")};
}

ShaderPair cut_shader(ShaderVariant v) {
  return {kWorldVertex, with_light(v, R"glsl(
in vec3 p_world, n_world;
uniform vec4 base;         // linear colour of the cut face
uniform vec4 hatch;        // linear colour of the lines; w = their strength
uniform vec2 hatch_lines;  // direction across them / spacing [1/px]
uniform float line_scale;
void main() {
  float across = dot(gl_FragCoord.xy, hatch_lines), per_pixel = length(hatch_lines);
  float away = abs(fract(across) - 0.5) / per_pixel;
  float cover = clamp(0.5 * 1.1 * line_scale + 0.5 - away, 0.0, 1.0) * hatch.w;
  gl_FragColor = vec4(shown(mix(base.rgb, hatch.rgb, cover)), 1.0);
}
)glsl")};
}

ShaderPair ball_shader(ShaderVariant v) {
  return {R"glsl(#version 130
out vec3 n_view;
void main() {
  n_view = gl_NormalMatrix * gl_Normal;
  gl_Position = gl_ModelViewProjectionMatrix * gl_Vertex;
}
)glsl",
          with_light(v, R"glsl(
in vec3 n_view;
void main() {
  vec3 n = normalize(n_view);
  float dark = step(0.0, n.x * n.y);  // four quarters, from wherever one looks
  float light = 0.72 + 0.28 * clamp(dot(n, vec3(-0.36, 0.48, 0.80)), 0.0, 1.0);
  vec3 c = mix(vec3(0.90), vec3(0.012), dark) * light;
  if (abs(n.z) < 0.25) c = vec3(0.012);  // a rim keeps it apart from what is behind
  gl_FragColor = vec4(shown(c), 1.0);
}
)glsl")};
}

}  // namespace robomosp::viewer
