#pragma once

namespace breakshot::sim_bridge::shaders {

// GLSL of the camera. All light is linear inside and encoded (square root, see linear() in mesh.hpp) where it leaves; the samples of a pixel
// are then averaged as encoded values, so that the half level of an edge marks its true place. (A real sensor averages linear light, which
// moves bright edges outwards by about a tenth of a pixel; the simulated camera leaves that bias out.)
//
// Each fragment program does one kind of surface: llvmpipe runs both sides of every branch.

/// Light, common to objects and to shadows on the table. What stands before it (light_program.hpp): LAMPS, how many; LIGHT, the type of an amount
/// of light: float when all of it is white, vec3 when not.
inline constexpr const char* kLight = R"(
  uniform vec3 light_W[LAMPS];        // unit vectors towards the lamps
  uniform float tan_softness[LAMPS];  // tangents of their angular radii
  uniform LIGHT level[LAMPS];         // their light on a level surface in the middle of the table
  uniform LIGHT ambient;              // light from everywhere
  uniform vec3 p_WC;                  // camera

  // The lamps' light is a little weaker away from the middle of the table.
  float key_falloff(vec2 p_W) { return 1.0 / (1.0 + 0.45 * dot(p_W, p_W)); }
)";

/// How a surface answers to the light; needs kLight.
inline constexpr const char* kShading = R"(
  // The light that leaves p towards the camera, encoded. `open`: share of the surroundings that the point sees; `shine`: of the highlight.
  vec3 shade(vec3 albedo, vec3 p, vec3 n, float open, float shine) {
    LIGHT scattered = ambient * open, mirrored = LIGHT(0.0);
    vec3 to_camera = normalize(p_WC - p);
    for (int i = 0; i < LAMPS; ++i) {
      LIGHT key = level[i] * (key_falloff(p.xy) / light_W[i].z);
      float h = max(dot(n, normalize(light_W[i] + to_camera)), 0.0);
      h *= h; h *= h; h *= h; h *= h; h *= h;  // to the power of 32
      scattered += key * max(dot(n, light_W[i]), 0.0);
      mirrored += key * (shine * h);
    }
    return sqrt(clamp(albedo * scattered + vec3(mirrored), 0.0, 1.0));
  }
)";

inline constexpr const char* kOutputs = R"(
  layout(location = 0) out vec4 colour;  // alpha 0: covers the background
  layout(location = 1) out uint depth;   // along the optical axis, 0.1 mm
  uint to_depth(float z) { return uint(min(10000.0 * z + 0.5, 65535.0)); }
)";

/// Discs: rays against upright cylinders. `jitter` says where in the pixel this layer samples, as a shift in clip space.
inline constexpr const char* kDiscVertex = R"(
  uniform vec2 jitter;
  layout(location = 0) in vec4 clip;
  layout(location = 1) in vec2 p_W;
  layout(location = 2) in vec4 disc;
  layout(location = 3) in vec3 paint;
  layout(location = 4) in vec4 visible;
  out vec2 v_along;
  out float v_key[LAMPS];
  flat out vec4 v_disc;
  flat out vec3 v_paint;
  void main() {
    v_along = p_W - p_WC.xy;
    for (int i = 0; i < LAMPS; ++i) v_key[i] = visible[i] * key_falloff(p_W) / light_W[i].z;
    v_disc = vec4((p_WC.xy - disc.xy) / disc.z, 1.0 / disc.z, disc.w / p_WC.z);
    v_paint = paint;
    gl_Position = vec4(clip.xy + jitter * clip.w, clip.zw);
  }
)";
/// SHINE (light_program.hpp) is 1 when discs have highlights.
inline constexpr const char* kDiscFragment = R"(
  uniform float near_plane;
  uniform vec2 shine[LAMPS];  // strength and exponent of the highlight
  in vec2 v_along;            // from below the camera to where the ray meets the table
  in float v_key[LAMPS];      // share of each lamp's light that arrives, divided by light_W.z
  flat in vec4 v_disc;        // place of the camera seen from the disc, in radii; 1 / radius; share of the ray below the plane of the top
  flat in vec3 v_paint;       // encoded
  void main() {
    // In radii, seen from above: the ray passes q at the height of the top and q + d at the table.
    vec2 reach = v_along * v_disc.z;
    vec2 q = v_disc.xy + (1.0 - v_disc.w) * reach;
    vec2 d = v_disc.w * reach;
    float qq = dot(q, q);
    bool top = qq <= 1.0;

    // Outside the circle of the top it may meet the side farther down: |q + s d| = 1, s from 0 at the top to 1 at the table.
    float dd = max(dot(d, d), 1e-12), qd = dot(q, d);
    float root = qd * qd - dd * (qq - 1.0);
    float s = (-qd - sqrt(max(root, 0.0))) / dd;
    if (!top && !(root >= 0.0 && s >= 0.0 && s <= 1.0)) discard;

    // The rim of the top is a bevel (a flat one: only its normals tilt), and a fine ring is turned into it.
    float bevel = 0.9 * smoothstep(0.81, 0.98, qq);
    vec2 wall = q + s * d;
    vec3 n = top ? vec3(bevel * q, 1.0) * inversesqrt(1.0 + bevel * bevel * qq) : vec3(wall, 0.0);
    LIGHT light = ambient * (top ? 1.0 - 0.25 * bevel : 0.60 - 0.27 * s);
    for (int i = 0; i < LAMPS; ++i) light += level[i] * (v_key[i] * max(dot(n, light_W[i]), 0.0));
    float finish = top ? 1.0 - 0.025 * clamp(1.0 - 20.0 * abs(qq - 0.40), 0.0, 1.0) : 0.90;
    vec3 encoded = v_paint * (finish * sqrt(light));
#if SHINE
    vec3 to_camera = normalize(vec3(-v_along, p_WC.z));
    LIGHT mirrored = LIGHT(0.0);
    for (int i = 0; i < LAMPS; ++i) {
      float h = max(dot(n, normalize(light_W[i] + to_camera)), 1e-6);
      mirrored += level[i] * (v_key[i] * shine[i].x * pow(h, shine[i].y));
    }
    encoded = sqrt(encoded * encoded + vec3(mirrored));
#endif
    colour = vec4(min(encoded, 1.0), 0.0);
    float z = (1.0 - v_disc.w * (top ? 1.0 : 1.0 - s)) / gl_FragCoord.w;
    depth = to_depth(z);
    gl_FragDepth = 1.0 - near_plane / z;
  }
)";

/// Table and floor.
inline constexpr const char* kTableVertex = R"(
  uniform vec2 jitter;
  layout(location = 0) in vec4 clip;
  layout(location = 1) in vec3 p_W;
  layout(location = 2) in vec3 normal_W;
  layout(location = 3) in vec3 albedo;
  out vec3 v_p;
  out vec3 v_normal;
  out vec3 v_albedo;
  void main() {
    v_p = p_W;
    v_normal = normal_W;
    v_albedo = albedo;
    gl_Position = vec4(clip.xy + jitter * clip.w, clip.zw);
  }
)";
inline constexpr const char* kTableFragment = R"(
  uniform float texture_strength;
  in vec3 v_p;
  in vec3 v_normal;
  in vec3 v_albedo;

  float hash(ivec2 cell) {
    uint h = uint(cell.x) * 374761393u + uint(cell.y) * 668265263u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return float((h ^ (h >> 16)) & 0xffffu) / 65535.0 - 0.5;
  }
  float value_noise(vec2 p) {
    vec2 f = fract(p);
    ivec2 i = ivec2(floor(p));
    f = f * f * (3.0 - 2.0 * f);
    return mix(mix(hash(i), hash(i + ivec2(1, 0)), f.x), mix(hash(i + ivec2(0, 1)), hash(i + ivec2(1, 1)), f.x), f.y);
  }

  void main() {
    vec2 p = v_p.xy;
    float speckle = 0.06 * value_noise(p * 16.0) + 0.05 * value_noise(p * 71.0) + 0.07 * value_noise(p * 410.0);
    vec3 n = normalize(v_normal);
    colour = vec4(shade(v_albedo * (1.0 + texture_strength * speckle), v_p, n, 0.6 + 0.4 * n.z, 0.0), 0.0);
    depth = to_depth(1.0 / gl_FragCoord.w);
  }
)";

/// The arm: smooth and large in the image, so lit per vertex.
inline constexpr const char* kArmVertex = R"(
  uniform vec2 jitter;
  layout(location = 0) in vec4 clip;
  layout(location = 1) in vec3 p_W;
  layout(location = 2) in vec3 normal_W;
  layout(location = 3) in vec3 albedo;
  out vec3 v_colour;
  void main() {
    v_colour = shade(albedo, p_W, normal_W, 0.6 + 0.4 * normal_W.z, 0.12);
    gl_Position = vec4(clip.xy + jitter * clip.w, clip.zw);
  }
)";
inline constexpr const char* kArmFragment = R"(
  in vec3 v_colour;
  void main() {
    colour = vec4(v_colour, 0.0);
    depth = to_depth(1.0 / gl_FragCoord.w);
  }
)";

/// Resets tiles: nothing there and the background visible, up to the given depth.
inline constexpr const char* kClearVertex = R"(
  layout(location = 0) in vec3 position;
  void main() { gl_Position = vec4(position, 1.0); }
)";
inline constexpr const char* kClearFragment = R"(
  void main() {
    colour = vec4(0.0, 0.0, 0.0, 1.0);
    depth = 0u;
  }
)";

/// Shadows on the table: the factor by which the background darkens, as an encoded value.
inline constexpr const char* kShadowCommon = R"(
  // A lamp's share of all light on the table.
  LIGHT lamp_share(int lamp, vec2 p_W) {
    LIGHT all = LIGHT(0.0);
    for (int i = 0; i < LAMPS; ++i) all += level[i];
    return level[lamp] * key_falloff(p_W) / (ambient + all * key_falloff(p_W));
  }
)";
inline constexpr const char* kShadowOutput = R"(
  uniform vec2 table_half;
  out vec4 factor;
  vec4 encoded(float lit) { return vec4(sqrt(lit)); }
  vec4 encoded(vec3 lit) { return vec4(sqrt(lit), 1.0); }
  bool on_table(vec2 p_W) { return all(lessThan(abs(p_W), table_half)); }
)";

inline constexpr const char* kDiscShadowVertex = R"(
  layout(location = 0) in vec4 clip;
  layout(location = 1) in vec2 p_W;
  layout(location = 2) in vec4 disc;  // centre, radius, height
  out vec2 v_p;
  out vec2 v_from_disc;
  out LIGHT v_lamp[LAMPS];
  flat out vec2 v_disc;  // radius, height
  void main() {
    v_p = p_W;
    v_from_disc = p_W - disc.xy;
    for (int i = 0; i < LAMPS; ++i) v_lamp[i] = lamp_share(i, p_W);
    v_disc = disc.zw;
    gl_Position = clip;
  }
)";
inline constexpr const char* kDiscShadowFragment = R"(
  in vec2 v_p;
  in vec2 v_from_disc;
  in LIGHT v_lamp[LAMPS];
  flat in vec2 v_disc;
  void main() {
    LIGHT lamps = LIGHT(0.0), lit = LIGHT(0.0);
    for (int i = 0; i < LAMPS; ++i) {
      // The ray to the lamp passes over p + slope * h at height h; the disc hides the lamp where that comes within its radius.
      vec2 slope = light_W[i].xy / light_W[i].z;
      float height = clamp(-dot(v_from_disc, slope) / max(dot(slope, slope), 1e-9), 0.0, v_disc.y);
      float penumbra = 0.0006 + tan_softness[i] / light_W[i].z * height;
      float visible = smoothstep(-penumbra, penumbra, length(v_from_disc + slope * height) - v_disc.x);
      lamps += v_lamp[i];
      lit += v_lamp[i] * visible;
    }
    // Beside a wall a point sees less of the sky, a little more than its height away all of it again.
    float near = 1.0 - clamp((length(v_from_disc) - v_disc.x) / (1.25 * v_disc.y), 0.0, 1.0);
    lit += (1.0 - lamps) * (1.0 - 0.42 * near * near * near);
    factor = on_table(v_p) ? encoded(max(lit, 0.0)) : vec4(1.0);
  }
)";

/// The shadow of one capsule of the arm before one lamp; the darkest of all counts. CapsuleShadow::visibility() in shadow.cpp is the same formula.
inline constexpr const char* kArmShadowVertex = R"(
  uniform vec2 fit;                      // share of the target that the image takes
  uniform int lamp;
  layout(location = 0) in vec4 clip;
  layout(location = 1) in vec2 p_W;
  layout(location = 2) in vec3 p_light;  // p_W in the lamp's axes
  layout(location = 3) in vec4 start;    // one end in the lamp's axes, radius
  layout(location = 4) in vec4 along;    // vector to the other end, 1 / squared length across the light
  out vec2 v_p;
  out vec3 v_from_start;
  out LIGHT v_lamp;
  flat out vec2 v_radius;                // and softness
  flat out vec4 v_along;
  void main() {
    v_p = p_W;
    v_from_start = p_light - start.xyz;
    v_lamp = lamp_share(lamp, p_W);
    v_radius = vec2(start.w, tan_softness[lamp]);
    v_along = along;
    gl_Position = vec4(clip.xy * fit + (fit - 1.0) * clip.w, clip.zw);
  }
)";
inline constexpr const char* kArmShadowFragment = R"(
  in vec2 v_p;
  in vec3 v_from_start;
  in LIGHT v_lamp;
  flat in vec2 v_radius;
  flat in vec4 v_along;
  void main() {
    float s = clamp(dot(v_from_start.xy, v_along.xy) * v_along.w, 0.0, 1.0);
    float height = max(s * v_along.z - v_from_start.z, 0.0);
    float penumbra = 0.0008 + v_radius.y * height;
    float visible = smoothstep(-penumbra, penumbra, length(s * v_along.xy - v_from_start.xy) - v_radius.x);
    factor = height > 0.0 && on_table(v_p) ? encoded(1.0 - v_lamp * (1.0 - visible)) : vec4(1.0);
  }
)";

}  // namespace breakshot::sim_bridge::shaders
