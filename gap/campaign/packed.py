"""A campaign in one file: a zip with campaign.toml and all that it names, unpacked for as long as it is read."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from ...core.errors import CosimError
from ...core.scratch import scratch
from ...ssp.archive import extract
from .campaign import Campaign, CampaignError
from .read import read
from .tables import take

CAMPAIGN = "campaign.toml"


@contextmanager
def opened(path: Path) -> Iterator[Path]:
    """The campaign.toml that a path names, or that is in a zip archive; what is unpacked is removed at the end.

    Raises `PackageError` for an archive that is damaged, larger than archives may be, or leaves its folder, and
    `CampaignError` for one without a campaign. What is raised meanwhile names files as in the archive.
    """
    if not (path.is_file() and zipfile.is_zipfile(path)):
        yield path
        return
    with scratch("campaign") as place:
        folder = extract(path, place / path.stem)
        found = [folder / CAMPAIGN, *sorted(folder.glob(f"*/{CAMPAIGN}"))]
        campaign = next((p for p in found if p.is_file()), None)
        if campaign is None:
            raise CampaignError(f"{path}: holds no {CAMPAIGN}; cosim-gap pack writes such an archive")
        _check_inside(path, folder, campaign)
        try:
            yield campaign
        except CosimError as error:
            error.args = tuple(a.replace(str(folder), str(path)) if isinstance(a, str) else a for a in error.args)
            raise


@contextmanager
def campaign_at(path: Path) -> Iterator[Campaign]:
    """The campaign of a campaign.toml or an archive; its files are there as long as the context lasts."""
    with opened(path) as file:
        campaign = read(file)
        yield campaign if file == path else replace(campaign, file=path / file.name)


def _check_inside(path: Path, folder: Path, campaign: Path) -> None:
    """Raise `CampaignError` for what a campaign in an archive names outside of it."""
    data = take.load(campaign)
    named = [data.get("system"), data.get("effects"), *(run.get("file") for run in take.tables(data, str(path), "run"))]
    for name in named:
        if isinstance(name, str) and not (campaign.parent / name).resolve().is_relative_to(folder.resolve()):
            raise CampaignError(f"{path}: names the file '{name}', which is not in it")
