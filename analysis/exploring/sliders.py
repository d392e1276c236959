"""Sets a slider from here, not by hand."""

import panel as pn
import param


def put(slider: pn.widgets.base.Widget, value: float) -> None:
    """Have a slider show a value, as if it had been dragged there.

    Panel leaves `value_throttled`, what a drag ended at, as it was, here and in the browser, which then does not tell
    of a drag that ends there again.
    """
    with param.edit_constant(slider):
        slider.param.update(value=value, value_throttled=value)
    for model, _ in slider._models.values():  # the browser's copy, which panel has no name for
        model.set_from_json("value_throttled", value)
