"""Sections of the case: half a ring from pole to pole as Gmsh writes it, and the wall of a tube as Abaqus does."""

from math import cos, pi, sin


def ring(across):
    """Write a ring of radii 10 and 20 mm with `across` elements along its radius and eight times as many around."""
    around = 8 * across
    number = lambda i, k: 1 + i + (across + 1) * k
    nodes, lines, quadrangles = [], [], []
    for k in range(around + 1):
        angle = pi * (k / around - 0.5)
        for i in range(across + 1):
            radius = 10 + 10 * i / across
            r = 0 if k in (0, around) else radius * cos(angle)
            nodes.append(f"{number(i, k)} {r:.10g} {radius * sin(angle):.10g} 0")
    for k in range(around):
        lines += [(2, number(0, k), number(0, k + 1)), (3, number(across, k), number(across, k + 1))]
        for i in range(across):
            quadrangles.append((number(i, k), number(i + 1, k), number(i + 1, k + 1), number(i, k + 1)))
    lines += [(4, number(i, around // 2), number(i + 1, around // 2)) for i in range(across)]
    elements = [f"1 2 {group} {group} {a} {b}" for group, a, b in lines]
    elements += ["3 2 1 1 " + " ".join(map(str, ring)) for ring in quadrangles]
    with open(f"ring-{across}.msh", "w") as file:
        print('$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n2 1 "ring"', file=file)
        print('1 2 "inside"\n1 3 "outside"\n1 4 "equator"\n$EndPhysicalNames', file=file)
        print("$Nodes", len(nodes), *nodes, "$EndNodes", "$Elements", len(elements), sep="\n", file=file)
        print(*(f"{k} {element}" for k, element in enumerate(elements, 1)), "$EndElements", sep="\n", file=file)


def wall(across, along):
    """Write a rectangle, r 10 to 20 mm and z 0 to 20 mm."""
    number = lambda i, k: 1 + i + (across + 1) * k
    with open("wall.inp", "w") as file:
        print("*NODE", file=file)
        for k in range(along + 1):
            for i in range(across + 1):
                print(number(i, k), 10 + 10 * i / across, 20 * k / along, sep=", ", file=file)
        print("*ELEMENT, TYPE=CAX4, ELSET=wall", file=file)
        for k in range(along):
            for i in range(across):
                corners = number(i, k), number(i + 1, k), number(i + 1, k + 1), number(i, k + 1)
                print(1 + i + across * k, *corners, sep=", ", file=file)
        count = across * along
        for name, side, first, last, step in [
            ("bore", "S4", 1, count - across + 1, across),
            ("shell", "S2", across, count, across),
            ("bottom", "S1", 1, across, 1),
            ("top", "S3", count - across + 1, count, 1),
        ]:
            print(f"*ELSET, ELSET=at-{name}, GENERATE\n{first}, {last}, {step}", file=file)
            print(f"*SURFACE, NAME={name}\nat-{name}, {side}", file=file)


for across in (2, 4, 8):
    ring(across)
wall(8, 8)
