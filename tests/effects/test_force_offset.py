"""Force offset: the same at every sample, and what a base's own offset is."""

import numpy as np

from mrfit.simulate.assembly import assemble


def test_offset_is_that_of_the_base_under_another_name() -> None:
    v = np.sin(np.arange(200) / 9)[None]
    base, whole = assemble("bingham"), assemble("bingham+force-offset")
    own = base.simulate(v, np.array([[300.0, 700.0, 45.0]]), 1e-3)
    added = whole.simulate(v, np.array([[300.0, 700.0, 20.0, 25.0]]), 1e-3)
    assert np.allclose(own, added, rtol=1e-14)
