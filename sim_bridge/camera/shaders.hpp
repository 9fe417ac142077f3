#pragma once

namespace breakshot::sim_bridge::shaders {

// GLSL of the camera. All light is linear inside and encoded (square root, see linear() in mesh.hpp) where it leaves; the samples of a pixel
// are then averaged as encoded values, so that the half level of an edge marks its true place. (A real sensor averages linear light, which
// moves bright edges outwards by about a tenth of a pixel; the simulated camera leaves that bias out.)
//
// Each fragment program does one kind of surface: llvmpipe runs both sides of every branch.

/// Light, common to objects and to shadows on the table.
inline constexpr const char* kLight = R"(
  uniform vec3 light_W;            // unit vector towards the light
  uniform float tan_softness;      // tangent of the light's angular radius
  uniform float ambient;           // share of light from everywhere
  uniform mat3 light_axes;         // columns: two unit vectors across the light's direction, and the direction
  uniform int capsule_count;       // solids of the arm, as capsules in the axes of the light
  uniform vec4 capsule_start[32];  // xyz of one end, radius
  uniform vec4 capsule_along[32];  // xyz to the other end, 1 / squared length across the light

  // Share of the area light that the arm leaves at p_W, 0 to 1.
  float arm_visibility(vec3 p_W) {
    vec3 p = p_W * light_axes;
    float visible = 1.0;
    for (int i = 0; i < capsule_count; ++i) {
      vec3 a = capsule_start[i].xyz - p;
      vec3 d = capsule_along[i].xyz;
      float s = clamp(-dot(a.xy, d.xy) * capsule_along[i].w, 0.0, 1.0);
      float height = a.z + s * d.z;
      float penumbra = 0.0008 + tan_softness * max(height, 0.0);
      float gap = length(a.xy + s * d.xy) - capsule_start[i].w;
      if (height > 0.0) visible = min(visible, smoothstep(-penumbra, penumbra, gap));
    }
    return visible;
  }

  // The key light is a little weaker away from the middle of the table.
  float key_falloff(vec2 p_W) { return 1.0 / (1.0 + 0.45 * dot(p_W, p_W)); }
)";

/// How a surface answers to the light; needs kLight.
inline constexpr const char* kShading = R"(
  uniform vec3 p_WC;  // camera

  // The light that leaves p towards the camera, encoded. `open`: share of the surroundings that the point sees; `shine`: of the highlight.
  vec3 shade(vec3 albedo, vec3 p, vec3 n, float visible, float open, float shine) {
    float key = (1.0 - ambient) * visible * key_falloff(p.xy) / light_W.z;
    float h = max(dot(n, normalize(light_W + normalize(p_WC - p))), 0.0);
    h *= h; h *= h; h *= h; h *= h; h *= h;  // to the power of 32
    return sqrt(clamp(albedo * (ambient * open + key * max(dot(n, light_W), 0.0)) + vec3(shine * key * h), 0.0, 1.0));
  }
)";

/// Discs, table and floor: lit per pixel.
inline constexpr const char* kSurfaceVertex = R"(
  uniform vec2 jitter;  // where in the pixel this layer samples, as a shift in clip space
  layout(location = 0) in vec4 clip;
  layout(location = 1) in vec3 p_W;
  layout(location = 2) in vec3 normal_W;
  layout(location = 3) in vec3 albedo;
  layout(location = 4) in vec2 rim;
  out vec3 v_p;
  out vec3 v_normal;
  out vec3 v_albedo;
  out vec2 v_rim;
  void main() {
    v_p = p_W;
    v_normal = normal_W;
    v_albedo = albedo;
    v_rim = rim;
    gl_Position = vec4(clip.xy + jitter * clip.w, clip.zw);
  }
)";

inline constexpr const char* kOutputs = R"(
  layout(location = 0) out vec4 colour;  // alpha 0: covers the background
  layout(location = 1) out uint depth;   // along the optical axis, 0.1 mm
  uint depth_here() { return uint(min(10000.0 / gl_FragCoord.w + 0.5, 65535.0)); }
)";

inline constexpr const char* kDiscFragment = R"(
  in vec3 v_p;
  in vec3 v_normal;
  in vec3 v_albedo;
  in vec2 v_rim;
  void main() {
    float r = length(v_rim);  // 0 on the side
    // The last tenth of the top's radius is a bevel (flat geometry, tilted normals), and a fine ring is turned into it.
    vec3 n = normalize(v_normal + vec3(v_rim * (0.9 * smoothstep(0.90, 0.99, r)), 0.0));
    float ring = smoothstep(0.60, 0.62, r) - smoothstep(0.64, 0.66, r);
    float top = step(0.5, v_normal.z);
    vec3 albedo = v_albedo * (mix(0.80, 1.0, top) - 0.05 * ring);
    float open = (0.6 + 0.4 * n.z) * mix(mix(0.55, 1.0, clamp(v_p.z * 50.0, 0.0, 1.0)), 1.0, top);
    colour = vec4(shade(albedo, v_p, n, arm_visibility(v_p), open, 0.06), 0.0);
    depth = depth_here();
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
    colour = vec4(shade(v_albedo * (1.0 + texture_strength * speckle), v_p, n, 1.0, 0.6 + 0.4 * n.z, 0.0), 0.0);
    depth = depth_here();
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
    v_colour = shade(albedo, p_W, normal_W, 1.0, 0.6 + 0.4 * normal_W.z, 0.12);
    gl_Position = vec4(clip.xy + jitter * clip.w, clip.zw);
  }
)";
inline constexpr const char* kArmFragment = R"(
  in vec3 v_colour;
  void main() {
    colour = vec4(v_colour, 0.0);
    depth = depth_here();
  }
)";

/// Empties the marked tiles: nothing there, background visible.
inline constexpr const char* kClearVertex = R"(
  layout(location = 0) in vec2 position;
  void main() { gl_Position = vec4(position, 1.0, 1.0); }
)";
inline constexpr const char* kClearFragment = R"(
  void main() {
    colour = vec4(0.0, 0.0, 0.0, 1.0);
    depth = 0u;
  }
)";

/// Shadows on the table: the factor by which the background darkens, as an encoded value.
inline constexpr const char* kShadowVertex = R"(
  layout(location = 0) in vec4 clip;
  layout(location = 1) in vec2 p_W;
  layout(location = 2) in vec4 disc;  // centre, radius, height; not used for the arm
  out vec2 v_p;
  flat out vec4 v_disc;
  void main() {
    v_p = p_W;
    v_disc = disc;
    gl_Position = clip;
  }
)";
inline constexpr const char* kShadowFactor = R"(
  uniform vec2 table_half;
  in vec2 v_p;
  flat in vec4 v_disc;
  out vec4 factor;
  vec4 darkening(float visible, float open) {
    float key = (1.0 - ambient) * key_falloff(v_p);
    float lit = (ambient * open + key * visible) / (ambient + key);
    bool on_table = all(lessThan(abs(v_p), table_half));
    return vec4(on_table ? sqrt(lit) : 1.0);
  }
)";
inline constexpr const char* kDiscShadowFragment = R"(
  void main() {
    // The ray to the light passes over p + slope * h at height h; the disc hides the light where that comes within its radius.
    vec2 slope = light_W.xy / light_W.z;
    vec2 p = v_p - v_disc.xy;
    float height = clamp(-dot(p, slope) / max(dot(slope, slope), 1e-9), 0.0, v_disc.w);
    float penumbra = 0.0006 + tan_softness * height / light_W.z;
    float visible = smoothstep(-penumbra, penumbra, length(p + slope * height) - v_disc.z);
    // Beside a wall a point sees less of the sky, two heights away all of it again.
    float near = 1.0 - clamp((length(p) - v_disc.z) / (2.0 * v_disc.w), 0.0, 1.0);
    factor = darkening(visible, 1.0 - 0.42 * near * near * near * near);
  }
)";
inline constexpr const char* kArmShadowFragment = R"(
  void main() { factor = darkening(arm_visibility(vec3(v_p, 0.0)), 1.0); }
)";

}  // namespace breakshot::sim_bridge::shaders
