"""Shapes, meshes and units at the edge of what is sensible."""
import numpy as np
from criteria import elastic_drift, energy_error, finite, momentum_drift
from stability import Mark, Scene


def ringing(run):
    return [elastic_drift(run, 2e-4), energy_error(run, 2e-4), momentum_drift(run, 1e-11),
            momentum_drift(run, 1e-11, "angular_momentum"), finite(run)]


SCENES = [
    Scene("one_element", "block", "no neighbour stiffens it", ringing,
          {"n_x": 1, "length": 10, "kick": 500, "end_time": 2e-4}),
    Scene("one_linear_element", "block", "degree 1: a constant strain and its bending", ringing,
          {"n_x": 1, "length": 10, "p": 1, "kick": 500, "end_time": 2e-4}),
    Scene("degree_5", "block", "degree 5: spectrum that folds, 216 points an element", ringing,
          {"p": 5, "kick": 500, "end_time": 2e-4}),
    Scene("c0_lines", "c0_block", "kinks between all elements of the blank", ringing,
          {"kick": 500, "end_time": 1e-3}),
    Scene("aspect_1000", "block", "elements 100 long and wide, 0.1 thick", ringing,
          {"length": 400, "width": 100, "height": 0.1, "kick": 100, "end_time": 1e-4}),
    Scene("slenderness_1000", "block", "a needle 1000 times as long as thick", ringing,
          {"length": 1000, "width": 1, "height": 1, "n_x": 50, "kick": 100, "end_time": 1e-3}),
    Scene("linear_layer", "block", "one layer of degree 1 through the thickness", ringing,
          {"length": 40, "height": 1, "p_z": 1, "kick": 100, "end_time": 4e-4}),
    Scene("graded_1000", "block", "the last element 1000 times as long as the first", ringing,
          {"grading": 1000, "n_x": 8, "kick": 200, "end_time": 2e-5}),
    Scene("skewed_75", "corners", "elements sheared by 75 degrees", ringing,
          {"shear": 112, "end_time": 2e-4}),
    Scene("tapered_50", "corners", "a top fifty times as large as the bottom", ringing,
          {"taper": 50, "kick": 200, "end_time": 2e-4}),
    Scene("weights_1000", "corners", "weights from 1e-3 to 1e3 along the block", ringing,
          {"ratio": 1e3, "ratio_z": 1e-3, "kick": 50, "end_time": 2e-5}),
]
