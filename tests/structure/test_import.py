import subprocess
import sys


def test_importing_the_room_loads_nothing_heavier_than_numpy():
    code = "import sys, fdi.structure; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in run.stdout.split()}
    assert "numpy" in loaded
    assert loaded.isdisjoint({"scipy", "networkx", "sympy", "pandas", "matplotlib"})
