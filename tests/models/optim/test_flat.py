import numpy as np
import torch
from torch import nn

from facert.errors import NumericalError
from facert.models.optim.flat import FlatObjective


class Quadratic(nn.Module):
    """Parameters of two shapes: the sum of squares, a weighted by ten."""

    def __init__(self):
        super().__init__()
        self.a = nn.Parameter(torch.tensor([[1.0, 2.0]], dtype=torch.float64))
        self.b = nn.Parameter(torch.tensor(3.0, dtype=torch.float64))

    def forward(self):
        return 10.0 * self.a.square().sum() + self.b.square()


class Failing(Quadratic):
    def forward(self):
        raise NumericalError("no")


class Overflowing(Quadratic):
    """A finite value whose gradient is not."""

    def forward(self):
        return self.a.sum() + self.b.abs().sqrt()


def test_the_vector_holds_the_parameters_in_their_order():
    np.testing.assert_array_equal(FlatObjective(Quadratic()).vector, [1.0, 2.0, 3.0])


def test_the_vector_sets_the_parameters():
    objective = FlatObjective(Quadratic())
    objective.vector = np.array([4.0, 5.0, 6.0])
    assert objective.module.a.tolist() == [[4.0, 5.0]]
    np.testing.assert_array_equal(objective.vector, [4.0, 5.0, 6.0])


def test_value_and_gradient_are_those_at_x():
    objective = FlatObjective(Quadratic())
    value, gradient = objective(np.array([1.0, 0.0, 2.0]))
    assert value == 14.0
    np.testing.assert_array_equal(gradient, [20.0, 0.0, 4.0])
    assert objective.evaluations == 1


def test_where_the_model_fails_the_value_is_infinite():
    for module in (Failing(), Overflowing()):
        assert FlatObjective(module)(np.zeros(3))[0] == np.inf
