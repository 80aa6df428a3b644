"""Pictures and tables of docs/how-the-tree-works.md, drawn from what crates/ropewalk-cli/examples/tree_figures.rs prints.

`scripts/pictures tree` calls this: every box, link and number is the product's own.
"""

import json
import pathlib
import re
import subprocess

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import ListedColormap
from matplotlib.patches import FancyArrowPatch, Rectangle
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "how-the-tree-works.md"

WALL, EMPTY, AXES = "#1b1b1b", "#e3eef7", ("#c2410c", "#1d4ed8")
#: Leaves by the number of walls in them.
FULL = ["#fff3d6", "#ffe0a3", "#ffc46b", "#f59e42", "#dd7a2a", "#b85a1c"]
RAY, MARK = "#b3123b", "#0f766e"


def figures():
    command = ["cargo", "run", "--release", "--quiet", "--locked", "-p", "ropewalk-cli", "--example", "tree_figures"]
    return json.loads(subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)


def center(box):
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def rectangle(box, **style):
    return Rectangle((box[0], box[1]), box[2] - box[0], box[3] - box[1], **style)


def save(figure, name, colors=None):
    figure.savefig(name, dpi=110, facecolor="white", bbox_inches="tight", pad_inches=0.06)
    plt.close(figure)
    if colors:
        Image.open(name).convert("RGB").quantize(colors, dither=Image.Dither.NONE).save(name, optimize=True)


class Plan:
    """The small scene and the ways to draw it."""

    def __init__(self, data):
        self.data = data
        self.walls = np.array(data["walls"])
        self.bounds = data["bounds"]

    def tree(self, name="cut"):
        return self.data["trees"][name]["nodes"]

    def axes(self, ax, walls=True, window=None):
        x0, y0, x1, y1 = window or self.bounds
        pad = 0.02 * (x1 - x0)
        ax.set(xlim=(x0 - pad, x1 + pad), ylim=(y0 - pad, y1 + pad), aspect="equal")
        ax.set_xticks([])
        ax.set_yticks([])
        for side in ax.spines.values():
            side.set_visible(False)
        if walls:
            ax.add_collection(LineCollection(self.walls, colors=WALL, linewidths=2, capstyle="round", zorder=5))

    def leaves(self, ax, nodes, style=None, edge="#8a8a8a"):
        for number, node in enumerate(nodes):
            if "walls" in node:
                count = len(node["walls"])
                fill = EMPTY if count == 0 else FULL[min(count, len(FULL)) - 1]
                fill = style(number, node) if style else fill
                ax.add_patch(rectangle(node["box"], facecolor=fill, edgecolor=edge, linewidth=0.7))


def cost(plan):
    data = plan.data["cost"]
    figure, axes = plt.subplots(
        2, 2, figsize=(8, 6), width_ratios=[3.2, 1], height_ratios=[2, 1], sharex="col", sharey="row",
        layout="constrained",
    )  # fmt: skip
    (top, right), (below, corner) = axes
    corner.axis("off")
    plan.axes(top)
    top.set_aspect("auto")
    best = {axis: min(zip(data[axis]["costs"], data[axis]["places"])) for axis in "xy"}
    middle = [(plan.bounds[a] + plan.bounds[a + 2]) / 2 for a in range(2)]
    below.plot(data["x"]["places"], data["x"]["costs"], color=AXES[0], linewidth=1.2)
    right.plot(data["y"]["costs"], data["y"]["places"], color=AXES[1], linewidth=1.2)
    below.axhline(data["leaf"], color="#777777", linestyle=":")
    right.axvline(data["leaf"], color="#777777", linestyle=":")
    below.text(plan.bounds[0], data["leaf"] + 0.4, f"no cut: {data['leaf']:.0f} tests", fontsize=8, color="#555555")
    for ax in (top, below):
        ax.axvline(best["x"][1], color=AXES[0], linewidth=1.4)
        ax.axvline(middle[0], color="#777777", linestyle="--", linewidth=1)
    for ax in (top, right):
        ax.axhline(best["y"][1], color=AXES[1], linewidth=1.4)
        ax.axhline(middle[1], color="#777777", linestyle="--", linewidth=1)
    below.plot(best["x"][1], best["x"][0], "o", color=AXES[0])
    right.plot(best["y"][0], best["y"][1], "o", color=AXES[1])
    for axis, ax in (("x", below), ("y", right)):
        low = best[axis][0] - 4
        (ax.set_ylim if axis == "x" else ax.set_xlim)(low, data["leaf"] + 4)
    below.annotate(
        f"{best['x'][0]:.1f}", (best["x"][1], best["x"][0]), xytext=(6, -12), textcoords="offset points", color=AXES[0]
    )
    right.annotate(
        f"{best['y'][0]:.1f}", (best["y"][0], best["y"][1]), xytext=(4, 6), textcoords="offset points", color=AXES[1]
    )
    below.set(xlabel="where the cut across x lies", ylabel="expected tests")
    right.set(xlabel="expected tests")
    right.tick_params(left=False, labelleft=False)
    right.set_title("cuts across y", fontsize=9)
    for ax in (below, right):
        ax.spines[["top", "right"]].set_visible(False)
    top.text(middle[0] + 0.08, plan.bounds[1], "middle", fontsize=8, color="#555555", va="bottom")
    save(figure, "tree-cost.png")
    numbers = {axis: np.interp(middle[i], data[axis]["places"], data[axis]["costs"]) for i, axis in enumerate("xy")}
    return {
        "leaf": data["leaf"],
        "best": {axis: best[axis] for axis in "xy"},
        "middle": numbers,
    }


def splits(plan):
    nodes = plan.tree()
    deepest = max(node["depth"] for node in nodes)
    figure, axes = plt.subplots(2, 3, figsize=(9, 4.5), layout="constrained")
    for ax, depth in zip(axes.flat, [1, 2, 3, 4, 6, deepest]):
        plan.axes(ax, walls=False)
        ax.add_collection(LineCollection(plan.walls, colors=WALL, linewidths=1.2, zorder=5))
        for node in nodes:
            if "walls" in node and node["depth"] <= depth and not node["walls"]:
                ax.add_patch(rectangle(node["box"], facecolor=EMPTY, edgecolor="none"))
        ax.add_patch(rectangle(plan.bounds, fill=False, edgecolor="#8a8a8a"))
        for node in nodes:
            if "split" in node and node["depth"] < depth:
                x0, y0, x1, y1 = node["box"]
                at, new = node["split"], node["depth"] == depth - 1
                ends = ([at, at], [y0, y1]) if node["axis"] == 0 else ([x0, x1], [at, at])
                ax.plot(*ends, color=AXES[node["axis"]], linewidth=1.8 if new and depth < deepest else 0.9)
        word = "cut" if depth == 1 else "levels of cuts"
        ax.set_title(f"all {depth} levels" if depth == deepest else f"{depth} {word}", fontsize=9)
    save(figure, "tree-cuts.png")


def side_by_side(plan, names, titles, style, file):
    figure, axes = plt.subplots(1, 2, figsize=(9, 2.9), layout="constrained")
    for ax, name, title in zip(axes, names, titles):
        plan.axes(ax)
        plan.leaves(ax, plan.tree(name), style)
        ax.set_title(title, fontsize=9)
    save(figure, file)


def empty(plan):
    names, titles = ("clipped", "cut"), []
    whole = np.prod(np.array(plan.bounds[2:]) - plan.bounds[:2])
    for name, what in zip(names, ("measure alone", "with a bonus for empty space")):
        boxes = np.array([node["box"] for node in plan.tree(name) if node.get("walls") == []])
        share = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1).sum() / whole
        titles.append(f"{what}: {share:.0%} of the plan is in empty leaves")
    side_by_side(plan, names, titles, None, "tree-empty.png")


def clipping(plan):
    def style(_, node):
        return "#f4b4c0" if 0 in node["walls"] else "white"

    counts = [sum(0 in node.get("walls", ()) for node in plan.tree(name)) for name in ("boxes", "clipped")]
    titles = [f"by their boxes: {counts[0]} leaves hold the long wall", f"clipped: {counts[1]} leaves"]
    side_by_side(plan, ("boxes", "clipped"), titles, style, "tree-clipping.png")
    return counts


def ray_ends(ray, t):
    origin, direction = np.array(ray["origin"][:2]), np.array(ray["direction"][:2])
    return np.array([origin, origin + t * direction])


def layout_of(nodes):
    """Places of nodes in a drawn tree: leaves side by side, parents above the middle of their children."""
    x, leaf = [0.0] * len(nodes), 0
    for i, node in enumerate(nodes):
        if "walls" in node:
            x[i], leaf = leaf, leaf + 1
    for i in reversed(range(len(nodes))):
        if "children" in nodes[i]:
            x[i] = np.mean([x[child] for child in nodes[i]["children"]])
    return [(x[i], -node["depth"]) for i, node in enumerate(nodes)]


def draw_tree(ax, nodes, color, size=14):
    at = layout_of(nodes)
    links = [(at[i], at[child]) for i, node in enumerate(nodes) for child in node.get("children", ())]
    ax.add_collection(LineCollection(links, colors="#b5b5b5", linewidths=0.7))
    for leaf, marker in ((False, "o"), (True, "s")):
        chosen = [i for i, node in enumerate(nodes) if ("walls" in node) == leaf]
        points = np.array([at[i] for i in chosen])
        ax.scatter(*points.T, s=size, marker=marker, c=[color(i) for i in chosen], edgecolors="#555555", linewidths=0.5, zorder=3)
    ax.axis("off")
    return at


def visited(ray):
    """Leaves in the order of the ray: those up to its hit, and those that it never sees."""
    t = ray["hit"][0]
    before = [leaf for leaf in ray["leaves"] if leaf[0] < t]
    return before, [leaf for leaf in ray["leaves"] if leaf[0] >= t]


def walk(plan):
    nodes, ray = plan.tree(), plan.data["ray"]
    before, behind = visited(ray)
    parent = {child: i for i, node in enumerate(nodes) for child in node.get("children", ())}
    seen = set()
    for _, _, node in before:
        while node is not None:
            seen.add(node)
            node = parent.get(node)
    inner = sum("children" in nodes[i] for i in seen)
    counts = ray["walks"]["ta-b"]
    assert (len(before), inner) == (counts["leaves"], counts["steps"]), "the picture shows another walk than was counted"
    figure, (left, right) = plt.subplots(2, 1, figsize=(8, 7.4), height_ratios=[1.55, 1], layout="constrained")
    plan.axes(left)
    leaves = {leaf[2] for leaf in before}
    hidden = {leaf[2] for leaf in behind}

    def style(number, node):
        if number in leaves:
            return "#cfe8e4" if not node["walls"] else "#8fcfc5"
        return "#f0f0f0" if number in hidden else "white"

    plan.leaves(left, nodes, style)
    end = ray_ends(ray, ray["hit"][0])
    far = ray_ends(ray, max(leaf[1] for leaf in ray["leaves"]))
    left.plot(*far.T, color=RAY, linewidth=0.8, linestyle=":", zorder=6)
    left.plot(*end.T, color=RAY, linewidth=1.8, zorder=6)
    left.plot(*end[1], "*", color=RAY, markersize=12, zorder=7)
    left.plot(*end[0], "o", color=RAY, zorder=7)
    for k, (enter, exit, _) in enumerate(before):
        point = ray_ends(ray, (max(enter, 0) + min(exit, ray["hit"][0])) / 2)[1]
        place, va = ([0, 0.1], "bottom") if k % 2 == 0 else ([0, -0.1], "top")
        if k == len(before) - 1:
            point, place = end[1], [0.22, -0.05]
        left.text(*(point + place), str(k + 1), fontsize=7.5, ha="center", va=va, zorder=8)
    color = lambda i: ("white" if i not in seen else "#8fcfc5" if nodes[i].get("walls") != [] else "#cfe8e4")
    at = draw_tree(right, nodes, color)
    for k, (_, _, node) in enumerate(before):
        x, y = at[node]
        right.text(x, y - 0.35, str(k + 1), fontsize=7, ha="center", va="top")
    save(figure, "tree-walk.png")
    return nodes, before


def rope_leaf(plan, nodes, before):
    """The leaf of the ray's way of which some side has most neighbours."""
    links = plan.data["ropes"]["leaves"]

    def score(leaf):
        sides = [len(side["neighbours"]) for side in links[str(leaf)]]
        return (sum(count > 1 for count in sides) >= 1, max(sides) if max(sides) <= 7 else 0, sum(count == 1 for count in sides))

    return max((leaf for _, _, leaf in before), key=score)


def arrow(ax, a, b, **style):
    ax.add_patch(FancyArrowPatch(a, b, arrowstyle="-|>", mutation_scale=11, shrinkA=0, shrinkB=0, zorder=9, **style))


def face_point(box, face):
    x, y = center(box)
    return [(box[0], y), (box[2], y), (x, box[1]), (x, box[3])][face]


def ropes(plan, nodes, before):
    leaf = rope_leaf(plan, nodes, before)
    box, sides = nodes[leaf]["box"], plan.data["ropes"]["leaves"][str(leaf)]
    most = max(range(4), key=lambda face: len(sides[face]["neighbours"]))
    figure, axes = plt.subplots(2, 1, figsize=(7, 8.4), layout="constrained")
    left, right = axes
    plan.axes(left)
    # The side in close view.
    along = 1 if most < 2 else 0
    place, half = shared_side(box, box, most), 0.6 * (box[along + 2] - box[along])
    wide, high = (1.8 * half, half) if most < 2 else (1.2 * half, 0.67 * half)
    plan.axes(right, window=[place[0] - wide, place[1] - high, place[0] + wide, place[1] + high])
    plan.leaves(left, nodes, lambda number, _: "#f4b4c0" if number == leaf else "white")
    for face, side in enumerate(sides):
        if side["rope"] is None:
            continue
        target = nodes[side["rope"]]
        single = "walls" in target
        left.add_patch(
            rectangle(target["box"], facecolor=MARK, alpha=0.13 if single else 0.07, edgecolor="none", zorder=2)
        )
        left.add_patch(
            rectangle(target["box"], fill=False, edgecolor=MARK, linestyle="-" if single else "--", linewidth=1.6, zorder=6)
        )
        arrow(left, face_point(box, face), inward(target["box"], face_point(box, face), face), color=MARK)
    left.set_title("ropes: one link a side, to a leaf or to a node (dashed)", fontsize=9)
    found = sides[most]["neighbours"]
    shades = plt.get_cmap("tab10").colors
    plan.leaves(right, nodes, lambda number, _: "#f4b4c0" if number == leaf else "white")
    for k, neighbour in enumerate(found):
        target = nodes[neighbour]["box"]
        right.add_patch(rectangle(target, facecolor=shades[k % 10], alpha=0.3, edgecolor=shades[k % 10], linewidth=1.4, zorder=3))
        overlap = shared_side(box, target, most)
        arrow(right, overlap, inward(target, overlap, most), color=shades[k % 10])
    right.set_title(f"the rope tree of one side leads straight to its {len(found)} neighbours", fontsize=9)
    save(figure, "tree-ropes.png")
    return leaf, sides, most


def inward(box, point, face):
    """A point inside of a box, across a side from a point on it."""
    reach = 0.5 * min(0.9, (box[2] - box[0]) if face < 2 else (box[3] - box[1]))
    step = [(-reach, 0), (reach, 0), (0, -reach), (0, reach)][face]
    return point[0] + step[0], point[1] + step[1]


def shared_side(box, other, face):
    along = 1 if face < 2 else 0
    middle = (max(box[along], other[along]) + min(box[along + 2], other[along + 2])) / 2
    plane = [box[0], box[2], box[1], box[3]][face]
    return (plane, middle) if face < 2 else (middle, plane)


def hops(plan, nodes, before):
    ray = plan.data["ray"]
    crossings = ray["walks"]["ropes from its leaf"]["crossings"]
    assert crossings == len(before) - 1 and not ray["walks"]["ropes from its leaf"]["restarts"]
    figure, ax = plt.subplots(figsize=(8, 4.3), layout="constrained")
    plan.axes(ax)
    leaves = {leaf[2] for leaf in before}
    plan.leaves(ax, nodes, lambda number, node: ("#8fcfc5" if node["walls"] else "#cfe8e4") if number in leaves else "white")
    ax.plot(*ray_ends(ray, ray["hit"][0]).T, color=RAY, linewidth=1, zorder=6)
    ax.plot(*ray_ends(ray, ray["hit"][0])[1], "*", color=RAY, markersize=12, zorder=10)
    places = [ray_ends(ray, (max(enter, 0) + min(exit, ray["hit"][0])) / 2)[1] for enter, exit, _ in before]
    for a, b in zip(places, places[1:]):
        style = {"connectionstyle": "arc3,rad=-0.55", "color": MARK, "linewidth": 1.4}
        arrow(ax, tuple(a), tuple(b), **style)
    save(figure, "tree-hops.png")


def once(plan):
    ray = plan.data["along"]
    nodes = plan.tree()
    before, _ = visited(ray)
    t, wall = ray["hit"]
    figure, ax = plt.subplots(figsize=(8, 4.2), layout="constrained")
    hit = ray_ends(ray, t)[1]
    window = [1.2, 1.2, 8.2, 5.2]
    plan.axes(ax, window=window)
    holds = {leaf: wall in nodes[leaf]["walls"] for _, _, leaf in before}
    plan.leaves(ax, nodes, lambda number, _: {True: "#f4b4c0", False: "#cfe8e4"}.get(holds.get(number), "white"))
    ax.add_collection(LineCollection([plan.walls[wall]], colors=RAY, linewidths=3, zorder=6))
    ends = ray_ends(ray, t)
    ax.plot(*ends.T, color=WALL, linewidth=1.4, zorder=7)
    ax.plot(*ends[0], "o", color=WALL, zorder=8)
    ax.plot(*hit, "*", color=WALL, markersize=13, zorder=8)
    lines = []
    for k, (enter, exit, leaf) in enumerate(before):
        point = ray_ends(ray, (max(enter, 0) + min(exit, t)) / 2)[1]
        point = hit + [0.3, -0.25] if enter <= t <= exit else point
        ax.text(point[0], point[1] + 0.07, str(k + 1), fontsize=10, ha="center", zorder=9)
        lines.append((k + 1, max(enter, 0), exit, len(nodes[leaf]["walls"]), holds[leaf], enter <= t <= exit))
    save(figure, "tree-once.png")
    return t, lines


def treelets(plan):
    nodes, cells = plan.tree(), plan.data["wide"]["cells"]
    lines = sorted({line for line, _, _ in cells})
    group = {}
    for i, node in enumerate(nodes):
        group.setdefault(i, i)
        for child in node.get("children", ()):
            fresh = "children" in nodes[child] and nodes[child]["depth"] % 3 == 0
            group[child] = child if fresh else group[i]
    # The product's treelets, drawn over the binary tree, must hold the same leaves.
    by_box = {tuple(node["box"]): i for i, node in enumerate(nodes) if "walls" in node}
    numbers = {}
    for line, _, box in cells:
        if tuple(box) in by_box:
            numbers.setdefault(line, set()).add(group[by_box[tuple(box)]])
    assert all(len(groups) == 1 for groups in numbers.values()), "a treelet holds leaves of two groups"
    shades = [plt.get_cmap("tab20").colors[i % 20] for i in range(len(lines) + 20)]
    order = {root: k for k, root in enumerate(dict.fromkeys(group[i] for i in range(len(nodes))))}
    figure, (left, right) = plt.subplots(2, 1, figsize=(8, 7), height_ratios=[1, 1.5], layout="constrained")
    draw_tree(left, nodes, lambda i: shades[order[group[i]]], size=26)
    plan.axes(right)
    plan.leaves(right, nodes, lambda i, _: (*shades[order[group[i]]], 0.6))
    save(figure, "tree-treelets.png")
    return len(lines)


def teapot(data):
    figure, ax = plt.subplots(figsize=(8.2, 4.6), layout="constrained")
    boxes = np.array(data["boxes"])
    colors = [EMPTY, FULL[1], FULL[3], FULL[5], "#4a2208"]
    counts = np.minimum(-(-boxes[:, 4].astype(int) // 8), len(colors) - 1)
    patches = [rectangle(box) for box in boxes]
    collection = PatchCollection(patches, edgecolors="#9aa5ad", linewidths=0.4, cmap=ListedColormap(colors))
    collection.set_array(counts)
    collection.set_clim(-0.5, len(colors) - 0.5)
    ax.add_collection(collection)
    ax.add_collection(LineCollection(data["outline"], colors="#111111", linewidths=0.8))
    ax.set(xlim=(boxes[:, 0].min(), boxes[:, 2].max()), ylim=(boxes[:, 1].min(), boxes[:, 3].max()), aspect="equal")
    ax.axis("off")
    bar = figure.colorbar(collection, ax=ax, ticks=range(len(colors)), shrink=0.8, label="blocks of eight in the leaf")
    bar.ax.set_yticklabels([*map(str, range(len(colors) - 1)), f"{len(colors) - 1} or more"])
    save(figure, "tree-teapot.png")


def heat(data):
    width, height = data["size"]
    titles = {"median": "cut in the middle", "area": "surface area", "best": "all ingredients", "best, rope trees": "... along rope trees"}
    means = {}
    figure, axes = plt.subplots(2, 4, figsize=(10, 4.1), layout="constrained")
    for row, kind in enumerate(("steps", "tests")):
        pictures = {name: np.reshape(data["methods"][name][kind], (height, width)) for name in titles}
        top = np.percentile(pictures["median"], 99.5)
        for ax, (name, picture) in zip(axes[row], pictures.items()):
            shown = ax.imshow(picture, cmap="inferno", vmin=0, vmax=top)
            ax.set_xticks([])
            ax.set_yticks([])
            means.setdefault(name, {})[kind] = picture.mean()
            ax.set_title(f"{titles[name]}: {picture.mean():.1f}", fontsize=9)
        figure.colorbar(shown, ax=axes[row], label=f"{kind} a pixel", shrink=0.9)
    # Few colours, for the size of the file.
    save(figure, "tree-heat.png", 64)
    return means


def rows(head, lines):
    cells = ["| " + " | ".join(map(str, line)) + " |" for line in [head, ["---"] * len(head), *lines]]
    return "\n".join(cells)


def tables(data, found):
    plan = data["plan"]
    names = {"boxes": "measure alone, walls as their boxes", "clipped": "... walls clipped to the cell", "cut": "... and empty space cut off"}
    trees = rows(
        ["tree", "inner nodes", "leaves", "of these empty", "references", "steps a ray", "leaves a ray", "tests a ray"],
        [
            [title, f["inner"], f["leaves"], f["empty"], f["references"], f"{m['steps']:.2f}", f"{m['leaves']:.2f}", f"{m['tests']:.2f}"]
            for key, title in names.items()
            for f, m in [(plan["trees"][key]["figures"], plan["trees"][key]["mean"])]
        ],
    )
    walks = plan["ray"]["walks"]
    titles = {
        "brute-force": "every wall, no tree", "sung-shirley": "from the root, by distances", "ta-b": "from the root, by points (TA-B)",
        "ropes": "ropes, first leaf found from the root", "ropes from its leaf": "ropes, first leaf known",
        "rope-trees": "rope trees, first leaf found from the root", "rope-trees from its leaf": "rope trees, first leaf known",
    }  # fmt: skip
    order = [key for key in titles if key in walks]
    wide = plan["ray"]["wide"]
    walked = rows(
        ["walk", "inner nodes", "leaves", "crossings", "rope-tree nodes", "tests"],
        [
            [titles[key], w["steps"], w["leaves"], w["crossings"], w["rope_tree_steps"], w["tests"]]
            for key in order
            for w in [walks[key]]
        ]
        + [["wide tree", f"{wide['steps']} treelets", wide["leaves"], 0, 0, f"{wide['blocks']} blocks of eight"]],
    )
    t, lines = found["once"]
    once = rows(
        ["leaf", "inside from t", "to t", "walls in it", "holds the long wall", "what follows"],
        [
            [k, f"{a:.3f}", f"{b:.3f}", count, "yes" if holds else "no", follows(holds, here, t)]
            for k, a, b, count, holds, here in lines
        ],
    )
    methods = data["heat"]["methods"]
    titles = {"median": "cut in the middle, x, y, z in turn", "area": "surface-area measure, exact", "best": "all ingredients (`best`), from the root", "best, rope trees": "the same tree along rope trees"}
    heat = rows(
        ["tree and walk", "leaves", "references", "steps a pixel", "tests a pixel"],
        [
            [title, f"{m['leaves']:,}", f"{m['references']:,}", f"{found['heat'][key]['steps']:.1f}", f"{found['heat'][key]['tests']:.1f}"]
            for key, title in titles.items()
            for m in [methods[key]]
        ],
    )
    best, middle = found["cost"]["best"], found["cost"]["middle"]
    cost_text = (
        f"The best cut across x leaves {best['x'][0]:.1f} tests of {found['cost']['leaf']:.0f}, the middle {middle['x']:.1f}; across y they leave "
        f"{best['y'][0]:.1f} and {middle['y']:.1f}."
    )
    cut, links = plan["trees"]["cut"]["figures"], plan["ropes"]
    ropes_text = (
        f"here they take {links['bytes_per_leaf'][0]:.0f} bytes a leaf, rope trees {links['bytes_per_leaf'][1]:.0f}, the nodes and references of the "
        f"tree itself {cut['bytes'] / cut['leaves']:.0f}"
    )
    wide_text = (
        f"{cut['inner']} inner nodes become {plan['wide']['treelets']} treelets, and the {walks['ta-b']['steps']} steps of the ray {wide['steps']}; "
        f"for an empty leaf there is nothing to visit."
    )
    pot = data["slice"]
    teapot_text = (
        f"{pot['primitives']:,} primitives, {pot['inner']:,} cuts in {pot['treelets']:,} treelets, {pot['leaves']:,} leaves, {pot['empty']:,} of them empty."
    )
    return {
        "trees": trees, "walks": walked, "once": once, "heat": heat,
        "cost": cost_text, "ropes": f"Ropes are not free: {ropes_text}.", "wide": wide_text, "teapot": teapot_text,
    }  # fmt: skip


def follows(holds, here, t):
    if not holds:
        return "nothing is met"
    if here:
        return "met again, the same number; it lies in this leaf, so it is the answer"
    return f"the wall is met at t = {t:.3f}, beyond the leaf: noted, the walk goes on"


def draw():
    """Draws all pictures into the working folder and writes the tables into the page."""
    data = figures()
    plan = Plan(data["plan"])
    found = {"cost": cost(plan)}
    splits(plan)
    empty(plan)
    found["clipping"] = clipping(plan)
    nodes, before = walk(plan)
    found["ropes"] = ropes(plan, nodes, before)
    hops(plan, nodes, before)
    found["once"] = once(plan)
    found["treelets"] = treelets(plan)
    teapot(data["slice"])
    found["heat"] = heat(data["heat"])
    text = PAGE.read_text()
    for name, table in tables(data, found).items():
        block = re.compile(rf"(<!-- {name}: written by scripts/pictures -->\n).*?(\n<!-- end -->)", re.DOTALL)
        if not block.search(text):
            raise SystemExit(f"pictures: {PAGE.name} has no place for the table {name}")
        text = block.sub(lambda m: m[1] + table + m[2], text)
    PAGE.write_text(text)
    facts = {key: value for key, value in data["slice"].items() if key not in ("boxes", "outline")}
    print(json.dumps({"found": {k: v for k, v in found.items() if k != "ropes"}, "slice": facts, "wide": {k: v for k, v in data["plan"]["wide"].items() if k != "cells"}, "ropes": {k: v for k, v in data["plan"]["ropes"].items() if k != "leaves"}, "plan": {k: v["figures"] for k, v in data["plan"]["trees"].items()}}, default=float))
