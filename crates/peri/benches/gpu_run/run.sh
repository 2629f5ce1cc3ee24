#!/bin/bash
# on the card: the hand-written limit, the bench, then whole runs; needs .gl (Vulkan loader), gpu-bench, peri (feature gpu, release), kw.py, limit.cu
for f in .gl/*.deb; do dpkg -x $f /; done; ldconfig
export XDG_RUNTIME_DIR=/tmp
cd .gpu; exec > >(tee $OUT/log.txt) 2>&1; nvidia-smi -L; nproc; date
nvcc -O3 -arch=sm_90 -o /tmp/limit limit.cu && /tmp/limit
timeout 60 ./gpu-bench 60 256; timeout 100 ./gpu-bench 128 128
for d in cpu gpu; do python3 kw.py 18 $d double 70 /tmp/$d.toml; (time timeout 150 ./peri run /tmp/$d.toml -o /tmp/out-$d) ; cat /tmp/out-$d/report.json | head -c 3000; done
python3 kw.py 36 gpu double 70 /tmp/full.toml; (time timeout 280 ./peri run /tmp/full.toml -o /tmp/out-full); head -c 3000 /tmp/out-full/report.json
date
