"""A block printed along wavy lines of short segments: G-code and a scene of crystfem.

python path.py SIDE LAYERS WINDOW [FOLDER]: a block of SIDE × SIDE mm and LAYERS layers of 0.5 mm, in lines 1 mm wide of segments of about 2.5 mm,
at 32 mm/s and 220 °C; births in windows of WINDOW s and steps as long. Then: crystfem run FOLDER/scene.toml -o OUTPUT
"""
import math, os, sys

side, layers, window = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
folder = sys.argv[4] if len(sys.argv) > 4 else '.'
os.makedirs(folder, exist_ok=True)
fed = 0.5 / (math.pi / 4 * 1.75**2)
count = round(side / 2.56)
code = ['M83', 'M109 S220', 'M190 S80']
for layer in range(layers):
    for line in range(side):
        along = [side * k / count for k in range(count + 1)]
        points = [(x, line + 0.5 + 0.05 * math.sin(2 * math.pi * x / 5.12)) for x in along]
        points = points[::-1] if line % 2 else points
        points = [p[::-1] for p in points] if layer % 2 else points
        code.append('G0 X{:.3f} Y{:.3f} Z{} F1920'.format(*points[0], 0.5 * (layer + 1)))
        code += ['G1 X{:.3f} Y{:.3f} E{:.5f} F1920'.format(*b, fed * math.dist(a, b)) for a, b in zip(points, points[1:])]
with open(os.path.join(folder, 'path.gcode'), 'w') as file:
    file.write('\n'.join(code) + '\n')
with open(os.path.join(folder, 'scene.toml'), 'w') as file:
    file.write(f'''version = 1
program = "crystfem"
title = "A path of many segments"

[mesh.path]
file = "path.gcode"
cell = ["0.5 mm", "0.5 mm", "0.5 mm"]

[materials.pa12]
law = "semicrystalline"
density = "1010 kg/m^3"
conductivity = "0.25 W/(m K)"
specific_heat = "2200 J/(kg K)"
kinetics = "table-4.1-column-1"
melting = "pa12"
crystallinity = 0.25

[[region]]
material = "pa12"
temperature = "220 degC"

[print]
window = "{window} s"

[[boundary]]
surface = "bottom"
film = "300 W/(m^2 K)"
ambient = "80 degC"

[[boundary]]
surface = "outer"
except = ["bottom"]
film = "15 W/(m^2 K)"
ambient = "80 degC"

[time]
scheme = "backward-euler"
step = "{window} s"

[output]
pictures = false
fields = false
''')
print(sum(line.startswith('G1') for line in code), 'segments')
