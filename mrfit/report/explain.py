"""A discovery in words, for the terminal and the page: verdict, where the error sits, effects, what would settle it."""

from typing import Any

from mrfit.core import registry
from mrfit.io.schemas.fit import DriftRow
from mrfit.io.schemas.reading import of_row
from mrfit.report.curves import prefixed
from mrfit.report.numbers import WITHIN_NOISE, in_html, percent, significant, with_interval
from mrfit.signal.drift import drift_words

Found = dict[str, Any]


def headline(found: Found) -> str:
    """Return the verdict in one sentence."""
    base, verdict = found["base_model"], found["verdict"]
    named = _listed([effect_words(e["name"]) for e in found["effects"]])
    suspects = _listed(found["ambiguous_set"], "or")
    if verdict == "named":
        return f"{base} lacks {named}."
    if verdict == "ambiguous":
        known = f"{base} lacks {named}, and something else besides" if named else f"Something is missing from {base}"
        return f"{known}: these data cannot tell whether it is {suspects}."
    if verdict == "unexplained":
        much = "all of it" if found.get("suspects") else "it"
        return f"Something is missing from {base}, and no effect of the library explains {much}."
    if verdict == "none":
        return f"Nothing that these data can show is missing from {base}."
    return f"These data are too few to say whether something is missing from {base}."


def effect_words(name: str) -> str:
    """Return an effect's title with its name in brackets."""
    title = registry.load("effect", name).SPEC.title
    return f"{title[:1].lower()}{title[1:]} ({name})"


def sentences(found: Found) -> list[str]:
    """Return the explanation: where the error sat, what the gap was and is, and what remains unexplained."""
    rows = [of_row(DriftRow, row) for row in found.get("drift") or ()]
    drift = [_sentence(drift_words(rows))] if rows else []
    if found["verdict"] == "insufficient-data":
        return [_sentence(text) for text in found["advice"]] + drift
    said = [_sentence(text) for text in found.get("where_text", [])[:1]]
    said.append(_gap(found))
    rest = found["unexplained"]
    if found["effects"] and _left_open(found):
        place = "; ".join(rest.get("text", [])[:2])
        said.append(f"{percent(rest['share_of_gap'])} of the gap stay unexplained" + (f": {place}." if place else "."))
    if rest.get("looks_text") and _left_open(found):
        said.append(_sentence(rest["looks_text"]))
    if found["verdict"] == "unexplained":
        said += [_sentence(text) for text in found.get("beyond_training", [])]
    if found["verdict"] == "unexplained" and found.get("suspects"):
        said.append(_partial(found))
    return said + drift


def _partial(found: Found) -> str:
    """Say what the effects that had proof, but leave too much to be named, would take."""
    said: dict[str, str] = {}
    for suspect in found["suspects"]:
        values = ", ".join(f"{row['name']} = {row['value']}" for row in parameter_rows(suspect))
        words = f"{effect_words(suspect['name'])} with {values}"
        if "instead_of" in suspect:
            said[suspect["instead_of"]] += f" (or {words}, which these data cannot tell from it)"
        else:
            said[suspect["name"]] = words
    closed = found["suspects"][0]["closed"]
    share = "part" if closed is None else percent(closed)
    return _sentence(
        f"{_listed(list(said.values()))} would take {share} of the gap, too little to be all that is missing: "
        "a cause among others, or the shadow of another"
    )


def _left_open(found: Found) -> bool:
    gap, share = found["gap"], found["unexplained"]["share_of_gap"]
    above = gap["noise_floor"] and gap["after"] > WITHIN_NOISE * gap["noise_floor"]
    return bool(share is not None and share > 0.02 and above)


def _gap(found: Found) -> str:
    gap = found["gap"]
    known = gap["noise_floor"] is not None
    floor = f"the noise floor is {percent(gap['noise_floor'])}" if known else "the noise floor is not known"
    if gap["before"] == gap["after"]:
        ratio = gap["before"] / gap["noise_floor"] if gap["noise_floor"] else None
        times = f"{in_html(significant(ratio))} times the noise floor" if ratio else floor
        return f"On held-out conditions the error is {percent(gap['before'])} of the range, {times}."
    standing = [e for e in found["augmented_model"].split("+") if e in found["ambiguous_set"]]
    stand_in = f" with {_listed(standing)} standing for the set" if standing else ""
    closed = f": {closed_share(gap['closed'])} % of the gap is closed" if gap["closed"] is not None else ""
    return (
        f"On held-out conditions the error falls from {percent(gap['before'])} to {percent(gap['after'])} of the range"
        f"{stand_in}; {floor}{closed}."
    )


def closed_share(share: float) -> str:
    """Return a share in percent, with more digits close to 100 so that almost all is not called all."""
    return in_html(significant(100.0 * share, 4 if 0.995 <= share < 1.0 else 3))


def parameter_rows(effect: Found) -> list[dict[str, str]]:
    """Return an effect's parameters as text: name, meaning, value with its unit, 95 % interval."""
    meaning = {p.name: p.text for p in registry.load("effect", effect["name"]).SPEC.params}
    rows = []
    for p in effect["parameters"]:
        factor, unit = prefixed(abs(p["value"]), p["unit"])
        scaled = [None if p[k] is None else factor * p[k] for k in ("low", "high")]
        value, low, high = (in_html(t) for t in with_interval(factor * p["value"], *scaled))
        interval = f"{low} to {high}" if scaled[0] is not None else "not determined"
        rows.append({"name": p["name"], "text": meaning.get(p["name"], ""), "value": f"{value} {unit}".strip()})
        rows[-1]["interval"] = f"{interval} {unit}".strip() if scaled[0] is not None else interval
    return rows


def next_step(found: Found) -> str:
    """Return the command that fits the model with what was found, empty where nothing was or it is not certain what."""
    if found["augmented_model"] == found["base_model"] or found["verdict"] == "ambiguous":
        return ""
    orders = (found.get("current_dependence") or {}).get("orders", ())
    order = f" --current-order {','.join(f'{name}={order}' for name, order in orders)}" if orders else ""
    return f"mrfit fit --model {found['augmented_model']}{order} --per all"


def _listed(names: list[str], joint: str = "and") -> str:
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} {joint} {names[-1]}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}" + ("" if text.endswith(".") else ".")
