"""Requests of services of unknown types: filled and read by the names of their fields.

A student may call them x, pos_x, y, yaw, theta, heading, yaw_deg, ..., or use a standard pose.
"""
import math

from tb3_labs.ros.conversions import to_quaternion

X, Y = ('x', 'pos_x', 'x_pos', 'x0', 'pose_x'), ('y', 'pos_y', 'y_pos', 'y0', 'pose_y')
#: What a request can take: a place, a heading, a heading whose unit is beyond doubt.
PLACE_X, PLACE_Y, YAW, UNIT = 'x', 'y', 'yaw', 'unit'
ALL = frozenset({PLACE_X, PLACE_Y, YAW})
ANGLES = ('yaw', 'theta', 'th', 'heading', 'angle', 'phi')


def fill_pose(request, pose):
    """Fill a Pose2 into a message, wherever it has fields for one.

    Returns what it took: a set of PLACE_X, PLACE_Y, YAW, and UNIT if the unit of the yaw is beyond
    doubt. A yaw whose name does not end in '_deg' is filled in rad.
    """
    filled = set()
    for name, kind in zip(request.__slots__, request._slot_types):
        low, value = name.lower(), getattr(request, name)
        bare = low[:-4] if low.endswith(('_deg', '_rad')) else low
        if kind == 'geometry_msgs/Pose':
            value.position.x, value.position.y = pose.x, pose.y
            value.orientation = to_quaternion(pose.yaw)
            filled |= ALL | {UNIT}
        elif hasattr(value, '_slot_types') and kind not in ('std_msgs/Header', 'time', 'duration'):
            filled |= fill_pose(value, pose)
        elif not kind.startswith('float') or '[' in kind:
            continue
        elif low in X:
            setattr(request, name, pose.x)
            filled.add(PLACE_X)
        elif low in Y:
            setattr(request, name, pose.y)
            filled.add(PLACE_Y)
        elif bare in ANGLES:
            setattr(request, name, math.degrees(pose.yaw) if low.endswith('_deg') else pose.yaw)
            filled |= {YAW, UNIT} if bare != low else {YAW}
    return filled


def is_origin(request):
    """Does a request declare (0, 0, 0), or no pose at all?"""
    for name, kind in zip(request.__slots__, request._slot_types):
        value = getattr(request, name)
        if hasattr(value, '_slot_types'):
            if kind != 'std_msgs/Header' and not is_origin(value):
                return False
        elif kind in ('float32', 'float64') and name != 'w' and abs(value) > 1e-6:
            return False
    return True
