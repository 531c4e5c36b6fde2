"""Diagnosis case: the input of a diagnosis - a model, a map and recordings - and how recordings
are read."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from diagnosis.criterion.threshold import DEFAULT_THRESHOLDS, Thresholds
from diagnosis.data.sampled_recording import SampledRecording, sample_windows
from diagnosis.estimation.checkpoint import FitCache, hash_of
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.model.compile_cache import node_text
from diagnosis.model.placed_effect import shipped_effects
from engine.recordings.recording import Recording, read_recording
from engine.recordings.recording_window import strip_window_suffix
from language.model.automaton import Automaton
from language.model.system import RecordingMap
from language.overlays.effect_reader import Effect
from language.overlays.expand_document import Project
from language.text.document import Document


@dataclass(frozen=True)
class Case:
    """The input of a diagnosis: an expanded automaton, a map and recordings.

    `names` are display names of files whose own names repeat, `recordings` are already read, and
    `opened_recordings` collects those that are read later. Fits are stored in `checkpoint_folder`,
    so an interrupted diagnosis continues. `before_fit` is called before each fit; it may raise to
    end the diagnosis.
    """

    document: Document
    project: Project
    mapping: RecordingMap
    train: tuple[Path, ...]
    held_out: tuple[Path, ...] = ()
    effects: tuple[Effect, ...] | None = None
    thresholds: Thresholds = DEFAULT_THRESHOLDS
    names: Mapping[Path, str] = field(default_factory=dict)
    recordings: Mapping[Path, Recording] = field(default_factory=dict, repr=False)
    opened_recordings: dict[Path, Recording] = field(default_factory=dict, repr=False)
    checkpoint_folder: Path | None = None
    before_fit: Callable[[], None] = lambda: None

    def name_of(self, path: Path) -> str:
        """Return the display name of a recording: that in `names`, else the file name."""
        return self.names.get(path, path.name)


def read_series(
    path: Path, case: Case, automaton: Automaton, output_names: Sequence[str]
) -> tuple[SampledRecording, ...]:
    """Return one sampled recording for each window of a file of a case, with its display name.

    A file that is not in `recordings`, or there without a needed channel, is read and stored in
    `opened_recordings`; only columns of inputs and of `output_names` are read. Raises SpecError,
    ValueError (too few samples) and MissingToolError.
    """
    used = [
        column.name
        for column in case.mapping.columns.values()
        if column.to in automaton.inputs or column.compare in output_names
    ]
    recording = case.recordings.get(path)
    if recording is None or not recording.channels.keys() >= set(used):
        recording = case.opened_recordings[path] = read_recording(path, case.mapping, used)
    named = dataclasses.replace(recording, name=case.name_of(path))
    return sample_windows(named, case.mapping, automaton, output_names)


def build_model_set(
    case: Case,
    automaton: Automaton,
    series: Sequence[SampledRecording],
    output_names: tuple[str, ...],
) -> ModelSet:
    """Return the model set of a case for sampled recordings, with the shipped effects by default.

    Its disturbances are at each balance of forces or torques; its fit cache is in the checkpoint
    folder of the case and has a key of the document and the effects. Nothing is compiled yet.
    """
    effects = case.effects if case.effects is not None else shipped_effects()
    drifts = balance_disturbances(case.document, automaton)
    bodies = [f"{one.name} {node_text(one.body)}" for one in effects]
    fit_cache = FitCache(
        case.checkpoint_folder, hash_of(node_text(case.document.root), bodies), case.before_fit
    )
    return ModelSet(
        case.document,
        case.project,
        automaton,
        effects,
        tuple(series),
        output_names,
        drifts,
        fit_cache,
    )


def file_digests(case: Case, files: tuple[Path, ...]) -> dict[str, str]:
    """Return the first 16 hexadecimal digits of the SHA-256 of each file, by display name.

    A window suffix of a path is ignored: the digest is of the whole file. Raises OSError if a file
    cannot be read.
    """
    return {
        case.name_of(path): hashlib.sha256(strip_window_suffix(path).read_bytes()).hexdigest()[:16]
        for path in files
    }
