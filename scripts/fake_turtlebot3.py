#!/usr/bin/env python3
"""The simulated robot behaves like a TurtleBot3 with its firmware, on the same topics.

Subscribes
    cmd_vel       geometry_msgs/Twist          linear.x [m/s], angular.z [rad/s]
    reset         std_msgs/Empty               the firmware's reset (see simulation/simulator.py)
Publishes (frames are in the node's namespace: robot3/odom in /robot3)
    imu           sensor_msgs/Imu              frame imu_link, ~imu_rate
    odom          nav_msgs/Odometry            odom -> base_footprint, ~odom_rate
    joint_states  sensor_msgs/JointState       with each odometry
    /tf           tf2_msgs/TFMessage           odom -> base_footprint, with each odometry
    /tf_static    tf2_msgs/TFMessage           world -> odom: true place of the odometry's origin
    ground_truth  geometry_msgs/PoseStamped    frame world, 50 Hz: for tests, never for control
    /clock        rosgraph_msgs/Clock          with use_sim_time, 200 per simulated second
Parameters
    ~speed        pace of /clock, times real time, with use_sim_time (1)
    ~network      quiet, good, busy, bad: network settings, see simulation/network.py (quiet)
    ~host         default, laptop, pi: rates, lags and stamps of the computer to which the robot's
                  board is connected, see simulation/simulator_config.py (default)
    ~mystery      1 to 9999: the number of a hidden fault, see simulation/mystery_robot.py (0: none)
    ~model        burger, waffle, waffle_pi (TURTLEBOT3_MODEL in the environment, else burger)
    all others    fields of SimulatorConfig, see simulation/simulator_config.py

The network delays imu, odom, joint_states and /tf. Messages that were delayed together reach a
subscriber in one write. A setting that is given by its own name overrides ~network and ~host. A
robot with a hidden fault publishes no ground_truth and no /tf_static, keeps its settings, and
ignores ~network and ~host. All other robots can change all fields except the FIXED_FIELDS while
they run: dynparam set /turtlebot3 network_cut true
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)

from dataclasses import dataclass, replace

import rospy

from tb3_labs.config import Config, setting
from tb3_labs.ros.live_settings import LiveSettings
from tb3_labs.ros.node import run_node
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.simulation.mystery_robot import LAST_NUMBER, HiddenFault
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.ros_fake_robot import FakeRobot, start_stepping
from tb3_labs.simulation.simulator_config import FIXED_FIELDS, HOSTS, SimulatorConfig


@dataclass(frozen=True)
class FakeTurtlebot3Config(Config):
    """The parameters that are not fields of SimulatorConfig."""

    speed: float = setting(1.0, 'pace of /clock, times real time, with use_sim_time',
                           low=0.1, high=20.0)
    network: str = setting('quiet', 'named network between robot and computer',
                           choices=tuple(NETWORKS))
    host: str = setting('default', "named computer to which the robot's board is connected",
                        choices=tuple(HOSTS))
    mystery: int = setting(0, 'number of a hidden fault to find by measuring; 0: none',
                           low=0, high=LAST_NUMBER)


def start_robot():
    """Start the simulated robot in this node's namespace."""
    settings, surroundings = read_config(SimulatorConfig, FakeTurtlebot3Config)
    settings = replace(settings, model=read_model().name)
    if surroundings.mystery:
        robot = FakeRobot(settings, HiddenFault(surroundings.mystery, settings))
        rospy.loginfo('mystery %d: one fault is hidden. There is no ground_truth, and no setting '
                      'can be changed while it runs.', surroundings.mystery)
    else:
        settings = _with_values(
            settings, {**NETWORKS[surroundings.network], **HOSTS[surroundings.host]})
        robot = FakeRobot(settings)
        LiveSettings(settings, robot.configure, fixed=FIXED_FIELDS)
    start_stepping(robot, surroundings.speed)


def _with_values(settings, values):
    """Returns `settings` with `values`, but keeps each setting that the user gave."""
    defaults = SimulatorConfig()
    changes = {name: value for name, value in values.items()
               if getattr(settings, name) == getattr(defaults, name)}
    return replace(settings, **changes)


if __name__ == '__main__':
    run_node('turtlebot3', start_robot, __doc__)
