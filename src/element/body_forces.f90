!> Internal forces of a body of several patches: patch by patch, then summed up at the seams.
module body_forces
  use kinds, only: wp
  use seams, only: seams_t
  use block_law, only: block_law_t
  use ig_patch, only: force_report_t
  use patch_body, only: patch_body_t, share_internal_forces
  use internal_force, only: internal_forces
  implicit none
  private

  public :: forces_of_bodies

contains

  !> Stress update and internal forces of all patches, from the motion that each holds.
  subroutine forces_of_bodies(bodies, seams, law, dt, report)
    type(patch_body_t), intent(inout) :: bodies(:)
    type(seams_t), intent(inout) :: seams
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                      !! [time]
    type(force_report_t), intent(out) :: report     !! of all patches together
    type(force_report_t) :: part
    integer :: p

    do p = 1, size(bodies)
      associate (body => bodies(p))
        call internal_forces(body%patch, body%buffers, law, dt, body%motion%x, body%motion%v, &
                             body%motion%internal_force, part)
      end associate
      report%internal_work = report%internal_work + part%internal_work
      report%viscous_work = report%viscous_work + part%viscous_work
      report%largest_rate = max(report%largest_rate, part%largest_rate)
      report%smallest_det = min(report%smallest_det, part%smallest_det)
      if (report%failed_block == huge(1) .and. part%failed_block < huge(1)) then
        report%failed_block = part%failed_block
        report%failed_patch = p
      end if
    end do
    call share_internal_forces(bodies, seams)
  end subroutine forces_of_bodies

end module body_forces
