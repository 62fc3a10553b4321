"""A film of the frames of a result: pictures of one view and one colour scale, as GIF or MP4."""
import contextlib
import importlib
import os
import shutil
import subprocess
import tempfile

import numpy as np
from PIL import Image

from post.picture import add_common_arguments, finished, images_of, new_job
from post.results import Results, ResultsError, counted
from post.style import SHADED, plt, with_palette

LARGEST = 1000, 700      # pixels of the scene
HOLD = 1.5               # seconds that a GIF shows its last frame


def add_arguments(command):
    command.add_argument("file", metavar="FILE", help="result file of igaform")
    command.add_argument("-o", "--out", default="", metavar="FILM",
                         help="the film to write, .gif or .mp4, the latter with ffmpeg (default: "
                              "FILE without its ending, -movie.gif)")
    command.add_argument("--fps", type=float, default=10.0, metavar="N",
                         help="frames per second (default: 10)")
    add_common_arguments(command)


def run(arguments):
    out = arguments.out or arguments.file.removesuffix(".h5") + "-movie.gif"
    write = writer_of(out)
    if not arguments.fps > 0:
        raise ResultsError(f"--fps {arguments.fps:g}: more than 0 is needed")
    with Results(arguments.file) as results:
        job, contents = new_job(results, list(range(len(results.times))), arguments, LARGEST)
        with tempfile.TemporaryDirectory() as folder:
            images = images_of(results, job, arguments.renderer, folder)
            pictures = [pixels(finished(results, job, content, image))
                        for content, image in zip(contents, images)]
    write(pictures, out, arguments.fps)
    print(f"film written: {out}, {counted(len(pictures), 'frame')}")
    return 0


def writer_of(path):
    """What writes a file of this name."""
    ending = os.path.splitext(path)[1].lower()
    if ending == ".gif":
        return write_gif
    if ending != ".mp4":
        raise ResultsError(f"'{path}' ends in '{ending}'; a film may be .gif or .mp4")
    if ffmpeg() is None:
        raise ResultsError("there is no ffmpeg on this machine to write an .mp4: install it, or "
                           "the Python package imageio-ffmpeg, or write a .gif")
    return write_mp4


def ffmpeg():
    """The program that writes an .mp4, of the machine or of the package imageio-ffmpeg; or None."""
    path = shutil.which("ffmpeg")
    if path is None:
        with contextlib.suppress(ImportError, RuntimeError):
            path = importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    return path


def pixels(figure):
    """A figure as an image."""
    figure.canvas.draw()
    image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
    plt.close(figure)
    return image


def write_gif(pictures, path, fps):
    """All frames with the palette of the last one, which has most colours."""
    palette = with_palette(pictures[-1], SHADED)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    times = [1000 / fps] * (len(frames) - 1) + [1000 * HOLD]
    try:
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=times, loop=0)
    except OSError as fault:
        raise ResultsError(f"cannot write '{path}': {fault.strerror}") from None


def write_mp4(pictures, path, fps):
    with tempfile.TemporaryDirectory() as folder:
        for i, picture in enumerate(pictures):
            width, height = (n - n % 2 for n in picture.size)     # the format wants even numbers
            picture.crop((0, 0, width, height)).save(os.path.join(folder, f"{i:05d}.png"))
        done = subprocess.run([ffmpeg(), "-y", "-loglevel", "error", "-framerate", f"{fps:g}", "-i",
                               os.path.join(folder, "%05d.png"), "-pix_fmt", "yuv420p", path],
                              capture_output=True, text=True, check=False)
    if done.returncode:
        raise ResultsError(f"ffmpeg cannot write '{path}': {done.stderr.strip()}")
