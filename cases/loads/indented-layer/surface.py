"""Writes sphere.stl, in mm: the lower end of a sphere of radius 80 mm up to 8 mm from its axis, in 12 rings of 48
quadrangles, closed by a wall and a lid, on the upper side of the layer at z = 8 mm. Corners lie on the sphere; a triangle
lies inside of it by up to r^2/2R, with the radius r of the circle through its corners: python3 surface.py"""

from math import cos, hypot, pi, sin
from struct import pack

RADIUS, RIM, RINGS, AROUND, TOP, LID = 80.0, 8.0, 12, 48, 8.0, 18.0


def corner(ring, k):
    angle, phi = RIM / RADIUS * ring / RINGS, 2 * pi * (k % AROUND) / AROUND
    across = RADIUS * sin(angle)
    return (across * cos(phi), across * sin(phi), TOP + RADIUS * (1 - cos(angle)))


def lifted(point):
    return (point[0], point[1], LID)


def triangles():
    for k in range(AROUND):
        for ring in range(RINGS):
            a, b = corner(ring, k), corner(ring, k + 1)
            c, d = corner(ring + 1, k + 1), corner(ring + 1, k)
            yield a, c, d
            if ring > 0:
                yield a, b, c
        a, b = corner(RINGS, k), corner(RINGS, k + 1)
        yield a, b, lifted(b)
        yield a, lifted(b), lifted(a)
        yield (0.0, 0.0, LID), lifted(a), lifted(b)


if __name__ == "__main__":
    all_of_them = list(triangles())
    with open("sphere.stl", "wb") as file:
        file.write(b"a sphere, mm".ljust(80) + pack("<I", len(all_of_them)))
        for triangle in all_of_them:
            file.write(pack("<12fH", 0, 0, 0, *(x for point in triangle for x in point), 0))
    step, arc = RIM / RINGS, 2 * pi * 4.0 / AROUND
    inside = (0.5 * hypot(step, arc)) ** 2 / (2 * RADIUS)
    print(f"{len(all_of_them)} triangles, at 4 mm from the axis up to {inside:.2e} mm inside of the sphere")
