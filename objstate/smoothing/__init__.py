"""The backward pass: p(state at t | the whole log), and the movements of objects."""

from objstate.smoothing.chain import Chain, smoothed_chain
from objstate.smoothing.doors import DoorHistory, SmoothedDoor, smoothed_door
from objstate.smoothing.furniture import FurnitureHistory, SmoothedFurniture, smoothed_furniture
from objstate.smoothing.movements import DoorRests, FurnitureRests, Movement, Rests, movements
from objstate.smoothing.objects import History, Smoothed, smoothed

__all__ = [
    "Chain",
    "DoorHistory",
    "DoorRests",
    "FurnitureHistory",
    "FurnitureRests",
    "History",
    "Movement",
    "Rests",
    "Smoothed",
    "SmoothedDoor",
    "SmoothedFurniture",
    "movements",
    "smoothed",
    "smoothed_chain",
    "smoothed_door",
    "smoothed_furniture",
]
