// Shadows of a roof on the floor below, in C++: a scene that frees itself, and exceptions.
//
//     c++ -std=c++17 shadows.cpp $(pkg-config --cflags --libs ropewalk) -o shadows && ./shadows
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <ropewalk.h>
#include <stdexcept>
#include <thread>
#include <vector>

namespace {

void check(RopewalkStatus status) {
    if (status != ROPEWALK_STATUS_OK) throw std::runtime_error(ropewalk_last_error());
}

struct Free {
    void operator()(RopewalkScene *scene) const { ropewalk_scene_free(scene); }
};
using Scene = std::unique_ptr<RopewalkScene, Free>;

Scene build(const std::vector<float> &vertices, const std::vector<std::uint32_t> &triangles) {
    RopewalkScene *scene = nullptr;
    check(ropewalk_scene_new(vertices.data(), vertices.size() / 3, triangles.data(), triangles.size() / 3, nullptr, &scene));
    return Scene(scene);
}

}  // namespace

int main() {
    // A square of edge 1 at height 1, over the middle of the floor.
    const Scene scene = build({-.5f, -.5f, 1, .5f, -.5f, 1, .5f, .5f, 1, -.5f, .5f, 1}, {0, 1, 2, 0, 2, 3});
    const int side = 200;
    std::vector<RopewalkRay> rays;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const float step = 2.0f / side;
            rays.push_back({{-1 + (x + .5f) * step, -1 + (y + .5f) * step, 0}, {0, 0, 1}, 0, std::numeric_limits<float>::infinity()});
        }
    // Any number of threads may ask one scene.
    const std::unique_ptr<bool[]> dark(new bool[rays.size()]);
    const std::size_t half = rays.size() / 2;
    std::thread other([&] { check(ropewalk_occluded(scene.get(), rays.data() + half, rays.size() - half, 1, dark.get() + half)); });
    check(ropewalk_occluded(scene.get(), rays.data(), half, 1, dark.get()));
    other.join();
    std::size_t shadow = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) shadow += dark[i];
    std::printf("%zu of %zu points lie in the shadow\n", shadow, rays.size());
    // A quarter of the floor, to the point.
    if (shadow != rays.size() / 4) return 1;
    try {
        build({0, 0, 0, 1, 0, 0, std::nanf(""), 0, 0}, {0, 1, 2});
    } catch (const std::runtime_error &error) {
        std::printf("refused as it should be: %s\n", error.what());
        return 0;
    }
    return 1;
}
