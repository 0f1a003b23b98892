"""The first problem of the transmission: does the car reach 120 mph within 20 s? Full throttle all the time just does."""

from problems.transmission import Transmission


class Simulator(Transmission):
    throttle = 50.0
