"""How the page looks: styles of its parts, and the HTML of headings and legends."""

import html

INK, QUIET, RULE = "#22303c", "#5b6873", "#d5dbe0"

BODY = "body { background: #f1f4f5; }"
PAGE = {"font-family": "system-ui, sans-serif", "margin": "0 auto", "padding": "12px", "gap": "12px"}
CARD = {"background": "white", "border-radius": "10px", "padding": "12px 14px", "box-shadow": "0 1px 4px #0002"}
CHART = {"flex": "1 1 260px"}
MESSAGE = {"padding": "8px 14px", "border-radius": "8px", "font-size": "14px", "position": "sticky", "z-index": "30"}
SAID = {**MESSAGE, "background": "#e5eff7", "color": "#0b4a75", "top": "80px"}
WRONG = {**SAID, "background": "#fde8e4", "color": "#8f1d06"}
WIDE, NARROW = "@media (min-width: 951px)", "@media (max-width: 950px)"
STAYS = f"{WIDE} {{ :host {{ position: sticky; top: 6px; z-index: 20; }} }}"  # in sight
LAST = f"{NARROW} {{ :host {{ order: 2; }} }}"  # below all else

#: Of the table of returns, what happened, and the colours below it.
NUMBERS = f"""
table {{ border-collapse: collapse; width: 100%; font-size: 14px; color: {INK}; }}
th {{ font-weight: 500; color: {QUIET}; text-align: right; padding: 1px 0 1px 12px; }}
td {{ text-align: right; padding: 2px 0 2px 12px; font-variant-numeric: tabular-nums; }}
th:first-child, td:first-child {{ text-align: left; padding-left: 0; }}
tr.sum td {{ border-top: 1px solid {RULE}; font-weight: 600; }}
p {{ margin: 6px 0 0; font-size: 13px; color: {INK}; }}
span {{ white-space: nowrap; margin-right: 8px; }}
i {{ display: inline-block; width: 11px; height: 11px; border-radius: 3px; margin-right: 4px; }}
"""


def heading(text: str, colour: str = INK) -> str:
    """Heading of a part."""
    return f'<b style="font-size:16px;color:{colour}">{html.escape(text)}</b>'


def introduction(title: str, text: str) -> str:
    """Title of the page, and what it is."""
    return (
        f'<div style="font-size:22px;font-weight:700;color:{INK}">{title}</div>'
        f'<div style="font-size:14px;color:{INK};max-width:900px">{text}</div>'
    )


def squares(colours: dict[str, str]) -> str:
    """What areas and bars of each colour are."""
    items = (f'<span><i style="background:{colour}"></i>{name}</span> ' for name, colour in colours.items())
    return f"<p>{''.join(items)}</p>"


def lines(colours: dict[str, str]) -> str:
    """What the line of each colour is; the last is dashed."""
    kinds = [*["solid"] * (len(colours) - 1), "dashed"]
    return (
        f'<div style="font-size:13px;color:{INK}">'
        + "".join(
            f'<span style="display:inline-block;width:24px;margin:0 6px 3px 0;border-top:3px {kind} {colour}"></span>'
            f'<span style="margin-right:18px">{name}</span>'
            for (name, colour), kind in zip(colours.items(), kinds, strict=True)
        )
        + "</div>"
    )
