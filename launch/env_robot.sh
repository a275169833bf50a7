#!/usr/bin/env bash
# Runs a command in the robot's ROS environment. It is the env loader of robot.launch, which calls it over SSH. (The
# robot's .bashrc does not set up ROS there: it returns early in a shell without a terminal.) Copy it to the robot's home
# folder, set the three values below, and try it from the laptop:
#     scp env_robot.sh pi@robot3:
#     ssh pi@robot3 chmod +x env_robot.sh
#     ssh pi@robot3 ./env_robot.sh rosversion -d
# The robot's whole bringup, lidar too, to a master that runs on the laptop:
#     ssh -t pi@robot3 ./env_robot.sh roslaunch turtlebot3_bringup turtlebot3_robot.launch
setup=~/catkin_ws/devel/setup.bash    # of the workspace with turtlebot3_bringup; or /opt/ros/noetic/setup.bash
model=burger                          # burger, waffle or waffle_pi
lidar=LDS-02                          # or LDS-01, the older one: the whole bringup asks for it

fail() { echo "$HOSTNAME: $0: $*" >&2; exit 1; }

[ $# -gt 0 ] || fail 'a command is missing: env_robot.sh COMMAND [ARGUMENTS]'
[ -r "$setup" ] || fail "$setup is missing: set the right setup= in this file"
case $model in burger | waffle | waffle_pi) ;; *) fail "model=$model is not valid: burger, waffle or waffle_pi" ;; esac

source "$setup" || fail "$setup failed"
command -v roslaunch >/dev/null || fail "$setup does not lead to roslaunch: set the right setup= in this file"

# roslaunch hands over the laptop's master. Without roslaunch, this file assumes a master
# on the computer from which you logged in.
laptop=${SSH_CONNECTION%% *}
export TURTLEBOT3_MODEL=$model LDS_MODEL=$lidar
export ROS_MASTER_URI=${ROS_MASTER_URI:-http://${laptop:-localhost}:11311}

# The robot's address, as seen on the way to the master (connecting a datagram socket sends nothing).
ROS_IP=$(python3 -I - "$ROS_MASTER_URI" 2>/dev/null <<'PYTHON'
import socket, sys, urllib.parse
uri = urllib.parse.urlparse(sys.argv[1])
probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
probe.connect((uri.hostname, uri.port or 11311))
print(probe.getsockname()[0])
PYTHON
) || fail "no way from here to ROS_MASTER_URI=$ROS_MASTER_URI: on the laptop set ROS_IP to its address in the robot's network"
export ROS_IP
unset ROS_HOSTNAME
case $ROS_IP:$laptop in
  127.*:127.* | 127.*:::1 | 127.*:) ;;
  127.*) fail "ROS_MASTER_URI=$ROS_MASTER_URI is this robot itself: on the laptop set ROS_IP to its address in the robot's network" ;;
esac
exec "$@"
