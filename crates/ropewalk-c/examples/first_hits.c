/* A sphere of triangles: nearest hits, surfaces, lists of hits, occlusion, a saved scene, errors.
 *
 *     cc first_hits.c $(pkg-config --cflags --libs ropewalk) -lm -o first_hits && ./first_hits scene.rope
 */
#include <math.h>
#include <ropewalk.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SLICES = 64, STACKS = 32, VERTICES = SLICES * (STACKS + 1), TRIANGLES = 2 * SLICES * STACKS, RAYS = 10000 };

static float vertices[VERTICES][3];
static uint32_t triangles[TRIANGLES][3];

static void check(RopewalkStatus status) {
    if (status != ROPEWALK_STATUS_OK) {
        fprintf(stderr, "ropewalk: %s\n", ropewalk_last_error());
        exit(1);
    }
}

static void expect(bool holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "not so: %s\n", what);
        exit(1);
    }
}

/* A unit sphere: rings of vertices from pole to pole. */
static void make_sphere(void) {
    const double pi = 3.14159265358979323846;
    for (int stack = 0; stack <= STACKS; stack++)
        for (int slice = 0; slice < SLICES; slice++) {
            double polar = pi * stack / STACKS, around = 2 * pi * slice / SLICES;
            float *v = vertices[stack * SLICES + slice];
            v[0] = (float)(sin(polar) * cos(around));
            v[1] = (float)(sin(polar) * sin(around));
            v[2] = (float)cos(polar);
        }
    for (int stack = 0; stack < STACKS; stack++)
        for (int slice = 0; slice < SLICES; slice++) {
            uint32_t a = (uint32_t)(stack * SLICES + slice), b = (uint32_t)(stack * SLICES + (slice + 1) % SLICES);
            uint32_t *t = triangles[2 * (stack * SLICES + slice)];
            t[0] = a, t[1] = a + SLICES, t[2] = b;
            t[3] = b, t[4] = a + SLICES, t[5] = b + SLICES;
        }
}

static bool never(double fraction, void *user) {
    (void)fraction;
    *(int *)user += 1;
    return false;
}

int main(int argc, char **argv) {
    make_sphere();
    RopewalkScene *scene;
    check(ropewalk_scene_new(&vertices[0][0], VERTICES, &triangles[0][0], TRIANGLES, NULL, &scene));
    expect(ropewalk_scene_size(scene) == TRIANGLES, "the scene has all triangles");

    /* Rays from outside towards points near the centre: each meets the sphere twice. */
    static RopewalkRay rays[RAYS];
    for (int i = 0; i < RAYS; i++) {
        double a = 0.1 + i, b = 2.5 * sin(i);
        RopewalkRay ray = {{(float)(3 * cos(a)), (float)(3 * sin(a)), (float)b}, {0}, 0, INFINITY};
        for (int k = 0; k < 3; k++) ray.direction[k] = 0.1f * (float)sin(7 * a + k) - ray.origin[k];
        rays[i] = ray;
    }
    static float t[RAYS];
    static uint32_t prim_id[RAYS], counts[RAYS];
    static bool occluded[RAYS];
    static RopewalkSurface surface[RAYS];
    check(ropewalk_closest_hit(scene, rays, RAYS, 0, t, prim_id));
    check(ropewalk_occluded(scene, rays, RAYS, 1, occluded));
    check(ropewalk_count_hits(scene, rays, RAYS, 2, counts));
    check(ropewalk_surface(scene, rays, RAYS, 0, t, prim_id, surface));
    for (int i = 0; i < RAYS; i++) {
        double square = 0, facing = 0;
        for (int k = 0; k < 3; k++) {
            double x = rays[i].origin[k] + (double)t[i] * rays[i].direction[k];
            square += x * x;
            facing += x * surface[i].normal[k];
        }
        expect(occluded[i] && counts[i] == 2 && prim_id[i] < TRIANGLES, "each ray meets the sphere twice");
        expect(fabs(sqrt(square) - 1) < 0.01, "hits lie on the sphere");
        expect(facing > 0.9 && surface[i].u >= 0 && surface[i].v >= 0, "normals point outwards");
    }

    RopewalkHitLists *lists;
    check(ropewalk_all_hits(scene, rays, RAYS, 0, 0, &lists));
    const size_t *offsets = ropewalk_hit_lists_offsets(lists);
    const float *all_t = ropewalk_hit_lists_t(lists);
    const uint32_t *all_prim_id = ropewalk_hit_lists_prim_id(lists);
    expect(offsets[RAYS] == 2 * RAYS, "the lists have all hits");
    for (int i = 0; i < RAYS; i++) {
        size_t first = offsets[i];
        expect(all_t[first] == t[i] && all_prim_id[first] == prim_id[i], "the first of a list is the nearest");
        expect(all_t[first] < all_t[first + 1], "lists are in order");
    }
    ropewalk_hit_lists_free(lists);

    if (argc > 1) {
        RopewalkScene *opened;
        check(ropewalk_scene_save(scene, argv[1]));
        check(ropewalk_scene_open(argv[1], true, &opened));
        static float again[RAYS];
        check(ropewalk_closest_hit(opened, rays, RAYS, 0, again, prim_id));
        expect(memcmp(t, again, sizeof t) == 0, "a saved scene answers the same");
        ropewalk_scene_free(opened);
    }

    /* What goes wrong is said. */
    RopewalkScene *none = scene;
    triangles[5][1] = VERTICES;
    expect(ropewalk_scene_new(&vertices[0][0], VERTICES, &triangles[0][0], TRIANGLES, NULL, &none)
               == ROPEWALK_STATUS_INVALID_ARGUMENT && none == NULL, "a triangle without its vertex is refused");
    printf("refused as it should be: %s\n", ropewalk_last_error());
    triangles[5][1] = 0;
    expect(ropewalk_scene_new(NULL, 3, &triangles[0][0], 1, NULL, &none) == ROPEWALK_STATUS_INVALID_ARGUMENT,
           "null is refused");
    expect(ropewalk_closest_hit(NULL, rays, RAYS, 0, t, prim_id) == ROPEWALK_STATUS_INVALID_ARGUMENT,
           "a query without a scene is refused");
    expect(ropewalk_closest_hit(scene, rays, SIZE_MAX, 0, t, prim_id) == ROPEWALK_STATUS_INVALID_ARGUMENT,
           "absurd counts are refused");
    expect(ropewalk_closest_hit(scene, NULL, 0, 0, NULL, NULL) == ROPEWALK_STATUS_OK, "no rays are fine");
    expect(ropewalk_scene_open("/nowhere/at/all.rope", false, &none) == ROPEWALK_STATUS_IO, "a file must be there");
    int calls = 0;
    RopewalkOptions options = ropewalk_options();
    options.preset = ROPEWALK_PRESET_FAST;
    options.progress = never;
    options.user = &calls;
    expect(ropewalk_scene_new(&vertices[0][0], VERTICES, &triangles[0][0], TRIANGLES, &options, &none)
               == ROPEWALK_STATUS_CANCELLED && calls == 1, "a build can be cancelled");
    options.progress = NULL;
    options.memory_limit = 1000;
    expect(ropewalk_scene_new(&vertices[0][0], VERTICES, &triangles[0][0], TRIANGLES, &options, &none)
               == ROPEWALK_STATUS_OUT_OF_MEMORY, "a limit is kept");
    options.preset = 17;
    expect(ropewalk_scene_new(&vertices[0][0], VERTICES, &triangles[0][0], TRIANGLES, &options, &none)
               == ROPEWALK_STATUS_INVALID_ARGUMENT, "unknown presets are refused");

    printf("%d rays over %zu triangles in %zu bytes: each met twice\n", RAYS, ropewalk_scene_size(scene),
           ropewalk_scene_bytes(scene));
    ropewalk_scene_free(scene);
    return 0;
}
