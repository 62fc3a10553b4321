"""The steps of a deck as a result tells them: names, times, frames and history samples."""
from typing import NamedTuple

import numpy as np

from post import model


class Step(NamedTuple):
    """Samples of the history from the last one of the step before, and the frames of a step."""
    number: int
    name: str
    samples: slice
    frames: np.ndarray

    @property
    def title(self):
        return f"step {self.number} {self.name}".rstrip()


def steps_of(results):
    """The steps that have been reached, in their order."""
    of_samples, of_frames = results.history("process_step"), results.file["frames/process_step"][:]
    names = model.step_names(results)
    steps = []
    for number in np.unique(of_samples):
        mine = np.flatnonzero(of_samples == number)
        name = names[number - 1] if number <= len(names) else ""
        steps.append(Step(int(number), name, slice(max(mine[0] - 1, 0), mine[-1] + 1),
                          np.flatnonzero(of_frames[:len(results.times)] == number)))
    return steps


def frame_before_release(results, frame):
    """The last frame of the step before that of a frame, or None."""
    before = [step for step in steps_of(results)
              if step.frames.size and step.frames[0] <= frame and frame not in step.frames]
    return int(before[-1].frames[-1]) if before else None
