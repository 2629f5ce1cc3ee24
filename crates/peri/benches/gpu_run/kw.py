# writes the plate of Kalthoff and Winkler, n cells across its 9 mm (36: 400 x 800 x 36): kw.py N DEVICE PRECISION END_US FILE
import sys
n, device, precision, end, name = int(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4], sys.argv[5]
dx = 9.0 / n
delta = 6 * dx * 1e-3
s0 = (5 * 42408 / (9 * 191e9 / 1.5 * delta)) ** 0.5
open(name, 'w').write(f'''version = 1
program = "peri"
title = "Kalthoff and Winkler's plate, {n} cells across"
[body]
space = "solid"
spacing = "{dx} mm"
horizon_ratio = 6.0001
shapes = [{{ add = "box", min = ["0 mm", "-100 mm", "0 mm"], max = ["100 mm", "100 mm", "9 mm"] }}]
cracks = [
  {{ from = ["-1 mm", "-25 mm", "-1 mm"], to = ["50.01 mm", "-25 mm", "-1 mm"], and = ["-1 mm", "-25 mm", "10 mm"] }},
  {{ from = ["-1 mm", "25 mm", "-1 mm"], to = ["50.01 mm", "25 mm", "-1 mm"], and = ["-1 mm", "25 mm", "10 mm"] }},
]
[material]
youngs_modulus = "191 GPa"
law = "linear"
critical = {{ stretch = {1 + s0} }}
[[boundary]]
name = "hit"
min = ["0 mm", "-25 mm", "0 mm"]
max = ["{3 * dx} mm", "25 mm", "9 mm"]
displacement = ["1.6 mm", "free", "free"]
[solver]
method = "verlet"
[dynamics]
density = "8000 kg/m^3"
end_time = "{end} us"
ramp = "100 us"
records = 7
device = "{device}"
precision = "{precision}"
[[probe]]
name = "crack"
track = "crack"
axis = "y"
damage = [0.3, 1.0]
[output]
pictures = false
fields = false
''')
