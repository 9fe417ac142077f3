#!/bin/bash
# Runs a real systemd as PID 1 of a private world: an overlay root on tmpfs, own processes, own cgroups; nothing reaches the host's files.
# To be started as: STAGE=folder unshare --mount --pid --uts --ipc --cgroup --fork --kill-child systemd_sandbox.sh
# What lies in $STAGE/opt appears under /opt.
set -e
mount --make-rprivate /
base=/mnt
mount -t tmpfs tmpfs $base
mkdir -p $base/upper $base/work $base/root
mount -t overlay overlay -o lowerdir=/,upperdir=$base/upper,workdir=$base/work $base/root
root=$base/root
mkdir -p $root/opt
cp -r "$STAGE/opt/." $root/opt/
mount -t proc proc $root/proc
mount -t sysfs sysfs $root/sys -o ro
for folder in run tmp; do mount -t tmpfs tmpfs $root/$folder -o mode=1777; done
mount -t tmpfs tmpfs $root/dev -o mode=755
for device in null zero random urandom full tty; do touch $root/dev/$device; mount --bind /dev/$device $root/dev/$device; done
mkdir -p $root/dev/shm $root/dev/pts $root/dev/mqueue $root/dev/hugepages $root/mnt/old
ln -s pts/ptmx $root/dev/ptmx
mount -t tmpfs tmpfs $root/dev/shm -o mode=1777
mount -t cgroup2 cgroup2 $root/sys/fs/cgroup
cd $root
pivot_root . mnt/old
umount -l /mnt/old
systemd-sysusers /opt/breakshot/lib/sysusers.d/breakshot.conf
# Only our units and the few of the system's that they rest on. A trailing ":" would append the default path, and with it all the host's services.
units=/opt/breakshot/lib/systemd/system
for unit in basic.target sysinit.target shutdown.target network.target systemd-journald.service systemd-journald.socket systemd-journald-dev-log.socket; do
  ln -s /lib/systemd/system/$unit $units/
done
export container=unshare SYSTEMD_UNIT_PATH=$units SYSTEMD_GENERATOR_PATH=/nonexistent
exec /lib/systemd/systemd --system --unit=basic.target --log-target=journal --show-status=no
