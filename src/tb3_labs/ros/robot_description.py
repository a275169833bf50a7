"""Prints the robot's URDF, which launch/view.launch puts on the parameter server for RViz:

    python3 launch/run.py robot_description MODEL [PREFIX]

The URDF describes a simple shape with the size of the robot. Links and joints have the same names
as in turtlebot3_description. Body and nose lie on the floor, so that they do not hide the goal, the
path and the true pose. The name of each link begins with PREFIX, since all robots share one tree.

The frame ``base_footprint`` is on the floor in the middle between the wheels. The frame
``base_link`` is above ``base_footprint``, at the height of the axle. In both frames x points
forward, and y to the left. Joints turn by positive angles when the robot drives forward.
"""
from tb3_labs.robot.turtlebot3 import RobotModel, robot_model
from tb3_labs.safe_output import run_tool

WHEEL_WIDTH = 0.018    # [m], for all models, as in turtlebot3_description
THICKNESS = 0.005      # height [m] of body and nose

_ROBOT = """<?xml version="1.0"?>
<robot name="turtlebot3_{name}">
  <material name="blue"><color rgba="0.25 0.6 1 1"/></material>
  <material name="white"><color rgba="1 1 1 1"/></material>
  <material name="dark"><color rgba="0.1 0.1 0.1 1"/></material>

  <link name="{prefix}base_footprint"/>
  <joint name="base_joint" type="fixed">
    <parent link="{prefix}base_footprint"/>
    <child link="{prefix}base_link"/>
    <origin xyz="0 0 {wheel_radius}"/>
  </joint>

  <link name="{prefix}base_link">
    <visual name="body">
      <origin xyz="0 0 {body_z}"/>
      <geometry><cylinder radius="{body_radius}" length="{thickness}"/></geometry>
      <material name="blue"/>
    </visual>
    <visual name="nose">
      <origin xyz="{nose_x} 0 {nose_z}"/>
      <geometry><box size="{body_radius} {nose_width} {thickness}"/></geometry>
      <material name="white"/>
    </visual>
  </link>
{wheels}</robot>
"""

_WHEEL = """
  <joint name="wheel_{side}_joint" type="continuous">
    <parent link="{prefix}base_link"/>
    <child link="{prefix}wheel_{side}_link"/>
    <origin xyz="0 {y} 0"/>
    <axis xyz="0 1 0"/>
  </joint>
  <link name="{prefix}wheel_{side}_link">
    <visual>
      <origin rpy="1.5707963 0 0"/>
      <geometry><cylinder radius="{radius}" length="{width}"/></geometry>
      <material name="dark"/>
    </visual>
  </link>
"""


def urdf(model: RobotModel, prefix: str) -> str:
    """Returns the URDF of `model`. The name of each link begins with `prefix`."""
    wheels = [_WHEEL.format(prefix=prefix, side=side, y=y, radius=model.wheel_radius,
                            width=WHEEL_WIDTH)
              for side, y in (('left', model.half_track), ('right', -model.half_track))]
    return _ROBOT.format(
        prefix=prefix, name=model.name, wheel_radius=model.wheel_radius,
        body_radius=model.body_radius, body_z=-model.wheel_radius - 2.0 * THICKNESS,
        nose_z=-model.wheel_radius - THICKNESS, nose_x=model.body_radius / 2.0,
        nose_width=model.body_radius / 2.0, thickness=THICKNESS, wheels=''.join(wheels))


def main(model, prefix='', *_):
    """Print the URDF. Returns 0, or an error text if `model` is unknown."""
    try:
        print(urdf(robot_model(model), prefix))
    except ValueError as error:
        return f'robot_description: {error}'
    return 0


if __name__ == '__main__':
    run_tool(lambda argv: main(*argv))
