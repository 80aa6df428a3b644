/* Ropewalk: ray casting on kd-trees. Made by cbindgen from crates/ropewalk-c; do not edit.
 *
 * All functions may be called from any thread at once. Those that return a RopewalkStatus leave a sentence for
 * ropewalk_last_error() when they fail. */

#ifndef ROPEWALK_H
#define ROPEWALK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The id that stands for no primitive.
#define ROPEWALK_NONE UINT32_MAX

// What a function returns.
typedef enum RopewalkStatus {
  // All went well.
  ROPEWALK_STATUS_OK = 0,
  // An argument is null or out of its range; the sentence names it, and the index in an array.
  ROPEWALK_STATUS_INVALID_ARGUMENT = 1,
  // The system has not enough memory.
  ROPEWALK_STATUS_OUT_OF_MEMORY = 2,
  // A file cannot be read or written.
  ROPEWALK_STATUS_IO = 3,
  // A file holds no sound scene.
  ROPEWALK_STATUS_BAD_FILE = 4,
  // The progress function asked to stop.
  ROPEWALK_STATUS_CANCELLED = 5,
  // A mistake of this library: please report it.
  ROPEWALK_STATUS_INTERNAL = 6,
} RopewalkStatus;

// How much work a build takes, and what the tree is worth for it: values of `RopewalkOptions::preset`.
typedef enum RopewalkPreset {
  // A third to half of the time, somewhat slower rays.
  ROPEWALK_PRESET_FAST = 0,
  // The default.
  ROPEWALK_PRESET_BALANCED = 1,
  // Exact sweeps: slower builds, rays a few per cent faster at best.
  ROPEWALK_PRESET_BEST = 2,
  // Less memory, somewhat slower rays.
  ROPEWALK_PRESET_COMPACT = 3,
} RopewalkPreset;

// The hits of several rays, one list a ray, each in the order of `t`, then of primitives.
typedef struct RopewalkHitLists RopewalkHitLists;

// Triangles and the tree over them. It never changes, and any number of threads may ask it at once.
typedef struct RopewalkScene RopewalkScene;

// Told how far a build is, 0 to 1, one call at a time but from any thread; returning false cancels the build.
typedef bool (*RopewalkProgress)(double fraction, void *user);

// How a scene is built; begin with `ropewalk_options()`.
typedef struct RopewalkOptions {
  // A `RopewalkPreset`.
  uint32_t preset;
  // Threads of the build; 0 is one a processor. The tree does not depend on it.
  uint32_t threads;
  // Bytes that build and tree may take beside the triangles; 0 for no limit. A build that needs more is refused before
  // it takes them.
  uint64_t memory_limit;
  // Called while the scene is built; may be null.
  RopewalkProgress progress;
  // Passed on to `progress`.
  void *user;
} RopewalkOptions;

// A ray: a hit at `t` is accepted if `t_min <= t <= t_max`, in lengths of `direction`, which need not be 1.
//
// Rays with NaN, an infinite origin or direction, a zero direction or `t_min > t_max` hit nothing.
typedef struct RopewalkRay {
  // Start point.
  float origin[3];
  // Direction.
  float direction[3];
  // Smallest accepted parameter, mostly 0.
  float t_min;
  // Largest accepted parameter; may be infinite.
  float t_max;
} RopewalkRay;

// The surface at a hit. All NaN for a miss.
typedef struct RopewalkSurface {
  // Weights of vertices 1 and 2: the hit is at `(1 - u - v) v0 + u v1 + v v2`, as Embree has it.
  float u;
  // See `u`.
  float v;
  // Unit normal, on the side from which the vertices run counter-clockwise.
  float normal[3];
} RopewalkSurface;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The sentence of the last function that failed on the calling thread; empty if none has. It stays valid until the
// next one fails on this thread, and need not be freed.
const char *ropewalk_last_error(void);

// The default options.
struct RopewalkOptions ropewalk_options(void);

// Builds a scene of triangles.
//
// `vertices` has three coordinates a vertex, `triangles` three vertices a triangle; triangle `i` is primitive `i`, hit on both
// sides. Both are copied. `options` may be null for the default. Triangles without area are kept and never hit.
//
// Writes the scene to `scene`, or null and returns what went wrong: vertices that are not finite, triangles that name no
// vertex, no triangles, a limit that is too small.
//
// # Safety
// The arrays must have that many entries, and `scene` room for a pointer.
enum RopewalkStatus ropewalk_scene_new(const float *vertices,
                                       size_t vertex_count,
                                       const uint32_t *triangles,
                                       size_t triangle_count,
                                       const struct RopewalkOptions *options,
                                       struct RopewalkScene **scene);

// Frees a scene; null is fine. It must not be used by any thread then.
//
// # Safety
// `scene` must be null or come from this library, and must not have been freed.
void ropewalk_scene_free(struct RopewalkScene *scene);

// Number of triangles; 0 for null.
//
// # Safety
// `scene` must be null or a scene.
size_t ropewalk_scene_size(const struct RopewalkScene *scene);

// Bytes of the tree with its own triangles; 0 for null. Of an opened scene they lie in its file.
//
// # Safety
// `scene` must be null or a scene.
size_t ropewalk_scene_bytes(const struct RopewalkScene *scene);

// Saves a scene into a file (UTF-8 path), written under another name and then renamed, so that there is a whole file or none.
//
// # Safety
// `scene` must be a scene, `path` end with a zero.
enum RopewalkStatus ropewalk_scene_save(const struct RopewalkScene *scene,
                                        const char *path);

// Opens a file that was saved here, in Rust, Python or by the command, by mapping it into memory; the primitives of several meshes
// are numbered through. Header, sizes and links are checked, and with `verify` the checksums of all bytes.
//
// # Safety
// `path` must end with a zero, and `scene` have room for a pointer; nobody may change the file while it is in use.
enum RopewalkStatus ropewalk_scene_open(const char *path,
                                        bool verify,
                                        struct RopewalkScene **scene);

// The first hit of each ray: its parameter (infinite for a miss) and primitive (`ROPEWALK_NONE` for a miss).
//
// `threads` is 1 for the calling thread alone, 0 for one a processor. Answers do not depend on it.
//
// # Safety
// `scene` must be a scene, the arrays must have `count` entries each and not overlap.
enum RopewalkStatus ropewalk_closest_hit(const struct RopewalkScene *scene,
                                         const struct RopewalkRay *rays,
                                         size_t count,
                                         uint32_t threads,
                                         float *t,
                                         uint32_t *prim_id);

// Whether each ray hits anything in its range.
//
// # Safety
// As for `ropewalk_closest_hit`.
enum RopewalkStatus ropewalk_occluded(const struct RopewalkScene *scene,
                                      const struct RopewalkRay *rays,
                                      size_t count,
                                      uint32_t threads,
                                      bool *occluded);

// The number of triangles that each ray hits.
//
// # Safety
// As for `ropewalk_closest_hit`.
enum RopewalkStatus ropewalk_count_hits(const struct RopewalkScene *scene,
                                        const struct RopewalkRay *rays,
                                        size_t count,
                                        uint32_t threads,
                                        uint32_t *hits);

// The surface at the hits that `ropewalk_closest_hit` has found for the same rays.
//
// # Safety
// As for `ropewalk_closest_hit`.
enum RopewalkStatus ropewalk_surface(const struct RopewalkScene *scene,
                                     const struct RopewalkRay *rays,
                                     size_t count,
                                     uint32_t threads,
                                     const float *t,
                                     const uint32_t *prim_id,
                                     struct RopewalkSurface *surface);

// All hits of each ray within its range, each once, in order; of `limit` above 0 the first `limit` of each.
//
// Writes the lists to `lists`, or null; they are to be freed by `ropewalk_hit_lists_free`.
//
// # Safety
// `scene` must be a scene, `rays` have `count` entries, `lists` have room for a pointer.
enum RopewalkStatus ropewalk_all_hits(const struct RopewalkScene *scene,
                                      const struct RopewalkRay *rays,
                                      size_t count,
                                      uint32_t threads,
                                      size_t limit,
                                      struct RopewalkHitLists **lists);

// Frees lists; null is fine.
//
// # Safety
// `lists` must be null or come from this library, and must not have been freed.
void ropewalk_hit_lists_free(struct RopewalkHitLists *lists);

// Where lists begin: those of ray `i` are the entries `offsets[i]` to `offsets[i + 1] - 1`; there is one offset more than there are
// rays, and the last one is the number of all hits. Null for null; valid until the lists are freed.
//
// # Safety
// `lists` must be null or lists.
const size_t *ropewalk_hit_lists_offsets(const struct RopewalkHitLists *lists);

// Parameters of the hits; see `ropewalk_hit_lists_offsets`.
//
// # Safety
// `lists` must be null or lists.
const float *ropewalk_hit_lists_t(const struct RopewalkHitLists *lists);

// Primitives of the hits; see `ropewalk_hit_lists_offsets`.
//
// # Safety
// `lists` must be null or lists.
const uint32_t *ropewalk_hit_lists_prim_id(const struct RopewalkHitLists *lists);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ROPEWALK_H */
