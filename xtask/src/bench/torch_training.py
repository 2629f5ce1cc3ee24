"""Seconds of an epoch of ANN-4 (Table 3.4) in PyTorch on one thread, medians, as JSON rows: fused Adam, MSE, shuffled
batches."""
import json
import statistics
import sys
import time

import torch

torch.set_num_threads(1)
torch.manual_seed(1)
rows, epochs = int(sys.argv[1]), int(sys.argv[2])
c = torch.randn(rows, 6)
s = torch.sin(c * torch.arange(1, 7))
measured = []
for batch in map(int, sys.argv[3:]):
    widths = [6, 224, 96, 64, 96, 6]
    after = [torch.nn.ReLU, torch.nn.Softplus, torch.nn.ReLU, torch.nn.Softplus, torch.nn.Identity]
    layers = [part for i, act in enumerate(after) for part in (torch.nn.Linear(widths[i], widths[i + 1]), act())]
    net = torch.nn.Sequential(*layers)
    adam = torch.optim.Adam(net.parameters(), lr=1e-3, fused=True)
    times = []
    for _ in range(epochs):
        since = time.perf_counter()
        for rows_of in torch.randperm(rows).split(batch):
            adam.zero_grad(set_to_none=True)
            ((net(c[rows_of]) - s[rows_of]) ** 2).sum(1).mean().backward()
            adam.step()
        times.append(time.perf_counter() - since)
    what = f"PyTorch {torch.__version__}, fused Adam, epoch of ANN-4, batch {batch}"
    measured.append({"what": what, "size": rows, "threads": 1, "value": statistics.median(times), "unit": "s"})
print(json.dumps(measured))
