"""Simulate a fit exported as JSON, without mrfit: tanh, its parameters polynomials of current. Prints its error."""

import json
import math
import sys


def at_current(parameter, current, ends):
    if "value" in parameter:
        return parameter["value"]
    held = min(max(current, ends[0]), ends[1])
    piece = next((p for p in parameter["pieces"] if held <= p["to"]), parameter["pieces"][-1])
    bent = lambda i: parameter["knee"] * math.tanh(i / parameter["knee"]) if parameter["knee"] else i  # noqa: E731
    held, total = bent(held), 0.0
    for k, (node, value) in enumerate(zip(piece["currents"], piece["values"], strict=True)):
        weight = 1.0
        for j, other in enumerate(piece["currents"]):
            if j != k:
                weight *= (held - bent(other)) / (bent(node) - bent(other))
        total += weight * (math.log(value) if parameter["ln"] else value)
    total = math.exp(total) if parameter["ln"] else total
    if parameter["bounds"]:
        total = min(max(total, parameter["bounds"][0]), parameter["bounds"][1])
    return total


with open(sys.argv[1]) as file:
    model = json.load(file)["export"]
assert model["base"] == "tanh" and not model["effects"]
check, worst = model["check"], 0.0
rows = zip(*(check["inputs"][name] for name in ("displacement", "velocity", "current")), check["output"], strict=True)
for x, v, current, expected in rows:
    p = {q["name"]: at_current(q, current, model["current_range"]) for q in model["parameters"]}
    force = p["fy"] * math.tanh(p["a1"] * v + p["a2"] * x) + p["c"] * v + p["k"] * x + p["f0"]
    worst = max(worst, abs(force - expected))
low, high = model["output"]["range"]
print(worst / (high - low))
