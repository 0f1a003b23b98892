"""AT1, the first problem of the transmission: does the car reach 120 mph in 20 s? With full throttle it just does."""

from problems.transmission import Transmission


class Simulator(Transmission):
    throttle = 50.0
