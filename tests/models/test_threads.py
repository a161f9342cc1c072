import pytest
import torch
from threadpoolctl import threadpool_info, threadpool_limits

from facert.models.threads import SMALL, threads_for


def blas_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def two_threads():
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    with threadpool_limits(2):
        yield
    torch.set_num_threads(before)


def test_small_problems_run_on_one_thread():
    with threads_for(SMALL):
        assert torch.get_num_threads() == 1
        assert blas_threads() == {1}


def test_large_problems_run_on_those_that_are_there():
    with threads_for(SMALL + 1):
        assert torch.get_num_threads() == 2


def test_the_number_of_threads_is_restored_after_an_error():
    before = blas_threads()
    with pytest.raises(RuntimeError), threads_for(10):
        raise RuntimeError
    assert torch.get_num_threads() == 2
    assert blas_threads() == before
