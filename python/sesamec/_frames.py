"""Tables of results as frames of pandas or polars, or as plain dictionaries where neither is installed."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, Union

if TYPE_CHECKING:
    import pandas
    import polars

#: What a table is returned as. `None` is pandas, else polars, else records, depending on what is installed.
Frame = Union[Literal["pandas", "polars", "records"], None]

#: What a column holds, and the types of pandas and polars for it.
Kind = Literal["text", "real", "whole", "seed", "flag"]
POLARS = {"text": "String", "real": "Float64", "whole": "Int64", "seed": "UInt64", "flag": "Boolean"}
PANDAS = {"text": "object", "real": "float64", "whole": "int64", "seed": "uint64", "flag": "bool"}
#: The same where values are missing.
PANDAS_MISSING = {"whole": "Int64", "seed": "UInt64", "flag": "boolean"}


@dataclass
class Table:
    """Columns with their kinds. `index` names the columns that are the index of a frame of pandas."""

    columns: dict[str, Kind]
    rows: list[tuple[Any, ...]]
    index: str | None = None
    units: dict[str, str] = field(default_factory=dict)

    def frame(self, frame: Frame) -> Any:
        """The table as asked for, or as what is installed."""
        if frame is None:
            installed = (name for name in ("pandas", "polars") if importlib.util.find_spec(name) is not None)
            frame = next(installed, "records")  # type: ignore[arg-type]  # both are names of frames
        if frame == "pandas":
            return self.to_pandas()
        if frame == "polars":
            return self.to_polars()
        if frame == "records":
            return self.records()
        raise ValueError(f'frame is "pandas", "polars" or "records", not {frame!r}')

    def records(self) -> list[dict[str, Any]]:
        """A dictionary for each row; what is missing is `None`."""
        return [dict(zip(self.columns, row)) for row in self.rows]

    def _values(self) -> dict[str, list[Any]]:
        return {name: [row[at] for row in self.rows] for at, name in enumerate(self.columns)}

    def to_pandas(self) -> pandas.DataFrame:
        """A frame of pandas; units are in `attrs["units"]`, by column."""
        import pandas

        series = {}
        for name, values in self._values().items():
            kind = self.columns[name]
            missing = any(value is None for value in values)
            dtype = PANDAS_MISSING.get(kind, PANDAS[kind]) if missing else PANDAS[kind]
            series[name] = pandas.Series(values, dtype=dtype, name=name)
        frame: pandas.DataFrame = pandas.DataFrame(series, columns=list(self.columns))
        if self.index is not None:
            frame = frame.set_index(self.index)
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_polars(self) -> polars.DataFrame:
        """A frame of polars, which has neither an index nor a place for units."""
        import polars

        schema = {name: getattr(polars, POLARS[kind]) for name, kind in self.columns.items()}
        return polars.DataFrame(self._values(), schema=schema)
